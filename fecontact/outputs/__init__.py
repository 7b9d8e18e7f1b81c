"""Everything that fecontact writes: records, tables, figures, ParaView files and meshes."""
