"""ParaView files and pictures in three dimensions."""
