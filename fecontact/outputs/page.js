"use strict";
// Spots over a picture: words beside the pointer or the focus; a click opens what a spot leads to. Without this script
// a spot is a link with a title.
{
  const tip = document.createElement("div"), dialog = document.createElement("dialog");
  tip.id = "tip";
  tip.hidden = true;
  dialog.innerHTML = "<form method='dialog'><button>Close</button></form><div></div>";
  const inside = dialog.lastChild;
  const spots = document.querySelectorAll(".spots a");
  if (spots.length) document.body.append(tip, dialog);
  for (const spot of spots) {
    const words = spot.title;
    spot.removeAttribute("title");
    spot.setAttribute("aria-label", words);
    const show = () => {
      const box = spot.getBoundingClientRect();
      tip.textContent = words;
      tip.hidden = false;
      const right = document.documentElement.clientWidth - tip.offsetWidth - 8;
      tip.style.left = `${Math.max(4, Math.min(right, box.right + 8)) + scrollX}px`;
      const below = box.bottom + 8 + tip.offsetHeight < innerHeight;
      tip.style.top = `${(below ? box.bottom + 8 : Math.max(4, box.top - 8 - tip.offsetHeight)) + scrollY}px`;
    };
    const hide = () => { tip.hidden = true; };
    for (const name of ["pointerenter", "focus"]) spot.addEventListener(name, show);
    for (const name of ["pointerleave", "blur"]) spot.addEventListener(name, hide);
    spot.addEventListener("click", event => {
      event.preventDefault();
      hide();
      const copy = document.getElementById(spot.hash.slice(1)).cloneNode(true);
      copy.removeAttribute("id");
      const title = document.createElement("h3");
      title.textContent = words.split("\n", 1)[0];
      inside.replaceChildren(title, copy);
      dialog.showModal();
    });
    spot.addEventListener("keydown", event => {
      // arrows go to the nearest spot of that side
      const [dx, dy] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key] || [];
      if (dx === undefined) return;
      event.preventDefault();
      const at = one => [parseFloat(one.style.left), parseFloat(one.style.top)], here = at(spot);
      const far = one => {
        const there = at(one), along = (there[0] - here[0]) * dx + (there[1] - here[1]) * dy;
        const beside = Math.abs((there[0] - here[0]) * dy) + Math.abs((there[1] - here[1]) * dx);
        return along > 0.01 ? along + 20 * beside : Infinity;
      };
      const next = [...spot.parentNode.children].reduce((a, b) => (far(b) < far(a) ? b : a));
      if (far(next) < Infinity) next.focus();
    });
  }
}

// A surface that turns: nodes x by s on the rail, raised along its normals by a pressure; without this script its
// picture is seen.
const STOPS = [[68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142], [31, 158, 137],
  [53, 183, 121], [109, 205, 89], [180, 222, 44], [253, 231, 37]]; // viridis
const colour = part => {
  const at = Math.min(part, 0.9999) * (STOPS.length - 1), k = Math.floor(at);
  return STOPS[k].map((low, c) => low + (at - k) * (STOPS[k + 1][c] - low));
};
for (const figure of document.querySelectorAll(".relief")) {
  const of = JSON.parse(figure.querySelector("script").textContent), canvas = document.createElement("canvas");
  const still = figure.querySelector("label"), pen = canvas.getContext("2d"), ns = of.y.length;
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", still.querySelector("img").alt);
  still.hidden = true;
  still.after(canvas);
  figure.querySelector("figcaption").append(" Drag it or use the arrow keys to rotate it; + and - zoom.");
  const raised = (x, y, z, ny, nz, p) => [x, y + p * of.mm_per_MPa * ny, z + p * of.mm_per_MPa * nz];
  const nodes = of.x.flatMap((x, i) => of.y.map((y, j) =>
    raised(x, y, of.z[j], of.ny[j], of.nz[j], of.p[i * ns + j])));
  const ellipse = of.ellipse.map(one => raised(...one));
  const middle = [0, 1, 2].map(axis => {
    const along = nodes.map(node => node[axis]);
    return (Math.min(...along) + Math.max(...along)) / 2;
  });
  const reach = Math.max(...nodes.map(node => Math.hypot(...node.map((value, axis) => value - middle[axis]))));
  let turn = 0.7, tilt = 0.75, zoom = 1, asked = false;
  const draw = () => {
    asked = false;
    const dense = window.devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight;
    canvas.width = wide * dense;
    canvas.height = high * dense;
    pen.scale(dense, dense);
    const [c, s, ct, st] = [Math.cos(turn), Math.sin(turn), Math.cos(tilt), Math.sin(tilt)];
    const scale = zoom * Math.min(0.5 * wide, 0.54 * high) / reach;
    // to the right, downwards, and towards the eye
    const seen = node => {
      const [x, y, z] = node.map((value, axis) => value - middle[axis]);
      const [u, v] = [c * y - s * x, s * y + c * x];
      return [wide / 2 + scale * u, high / 2 - scale * (st * v + ct * z), st * z - ct * v];
    };
    const points = nodes.map(seen), quads = [];
    for (let i = 0; i + 1 < of.x.length; i++) {
      for (let j = 0; j + 1 < ns; j++) {
        const k = i * ns + j, corners = [k, k + 1, k + ns + 1, k + ns];
        quads.push([corners.reduce((sum, one) => sum + points[one][2], 0), corners]);
      }
    }
    quads.sort((a, b) => a[0] - b[0]);
    for (const [, corners] of quads) {
      const [a, b, , d] = corners.map(one => nodes[one]), pressed = Math.max(...corners.map(one => of.p[one]));
      const [e, f] = [b, d].map(one => one.map((value, axis) => value - a[axis]));
      const n = [f[1] * e[2] - f[2] * e[1], f[2] * e[0] - f[0] * e[2], f[0] * e[1] - f[1] * e[0]];
      const light = 0.62 + 0.38 * Math.abs(n[2] + 0.35 * n[0] - 0.25 * n[1]) / (1.1 * Math.hypot(...n));
      const [r, g, bl] = (pressed > 0 ? colour(pressed / of.peak_MPa) : [168, 172, 178]).map(one => one * light);
      pen.fillStyle = pen.strokeStyle = `rgb(${r},${g},${bl})`;
      pen.beginPath();
      corners.forEach((one, at) => pen[at ? "lineTo" : "moveTo"](points[one][0], points[one][1]));
      pen.closePath();
      pen.fill();
      pen.stroke();
    }
    for (const [ink, width] of [["#000", 4], ["#fff", 2]]) {
      pen.beginPath();
      ellipse.map(seen).forEach(([u, v], at) => pen[at ? "lineTo" : "moveTo"](u, v));
      pen.setLineDash([9, 5]);
      pen.lineWidth = width;
      pen.strokeStyle = ink;
      pen.stroke();
    }
    pen.setLineDash([]);
    pen.lineWidth = 1;
    pen.fillStyle = getComputedStyle(figure).color;
    pen.font = "14px system-ui, sans-serif";
    const bar = Math.min(200, wide - 130);
    for (let at = 0; at < bar; at++) {
      pen.fillStyle = `rgb(${colour(at / bar)})`;
      pen.fillRect(22 + at, 8, 1.5, 12);
    }
    pen.fillStyle = getComputedStyle(figure).color;
    pen.fillText("0", 8, 19);
    pen.fillText(`${of.peak_MPa} MPa`, 30 + bar, 19);
    const [first, last] = [0, ns - 1].map(j => seen([0, of.y[j], of.z[j]]));
    pen.textAlign = "center";
    of.sides.forEach((side, at) => pen.fillText(side, ...[first, last][at].slice(0, 2).map((v, n) => v + 16 * n)));
    const ahead = seen([1.12 * Math.max(...of.x), 0, 0]);
    pen.fillText("rolling x →", ahead[0], ahead[1]);
  };
  const ask = () => { if (!asked) asked = requestAnimationFrame(draw); };
  const move = (right, up) => { turn += right; tilt = Math.max(0.05, Math.min(1.57, tilt + up)); ask(); };
  canvas.addEventListener("pointerdown", event => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", event => {
    if (event.buttons) move(0.01 * event.movementX, 0.01 * event.movementY);
  });
  canvas.addEventListener("keydown", event => {
    const way = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
    const nearer = { "+": 1.2, "-": 1 / 1.2 }[event.key];
    if (!way && !nearer) return;
    event.preventDefault();
    zoom *= nearer || 1;
    move(...(way || [0, 0]));
  });
  new ResizeObserver(ask).observe(canvas);
}
