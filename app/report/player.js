// Draws the hand of a report: points and bones on a canvas, turned by dragging, played in time.
(function () {
  "use strict";
  const canvas = document.getElementById("hand");
  if (!canvas) return;
  const given = JSON.parse(document.getElementById("replay-data").textContent);
  const raw = Uint8Array.from(atob(given.data), (c) => c.charCodeAt(0));
  const places = new Int16Array(raw.buffer);
  const button = document.getElementById("play"), slider = document.getElementById("at");
  const clock = document.getElementById("clock"), speed = document.getElementById("speed");
  const pen = canvas.getContext("2d");
  let frame = 0, playing = false, last = 0, turn = -0.5, tilt = 0.9, zoom = 1;
  slider.max = given.frames - 1;

  function point(index) {
    const at = 3 * (Math.floor(frame) * given.points + index);
    return [places[at] * given.unit, places[at + 1] * given.unit, places[at + 2] * given.unit];
  }
  function seen(place, size) {
    const [x, y, z] = [place[0], place[1] - 0.08, place[2]];
    const a = Math.cos(turn) * x - Math.sin(turn) * y, b = Math.sin(turn) * x + Math.cos(turn) * y;
    const up = Math.sin(tilt) * b + Math.cos(tilt) * z, deep = Math.cos(tilt) * b - Math.sin(tilt) * z;
    const scale = zoom * size.unit / (1 + 0.9 * deep);
    return { x: size.w / 2 + scale * a, y: size.h * 0.55 - scale * up, deep: deep, scale: scale };
  }
  function shaded(colour, deep) {
    const fade = Math.min(0.45, Math.max(0, 0.15 + 1.6 * deep));
    const parts = [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));
    return "rgb(" + parts.map((p) => Math.round(p + (235 - p) * fade)).join(",") + ")";
  }
  function draw() {
    const ratio = window.devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
    if (canvas.width !== Math.round(w * ratio)) { canvas.width = w * ratio; canvas.height = h * ratio; }
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, w, h);
    const size = { w: w, h: h, unit: Math.min(w, 1.5 * h) * 2.9 };
    const at = [];
    for (let i = 0; i < given.points; i++) at.push(seen(point(i), size));
    const things = given.bones.map((bone, i) => ({
      deep: (at[bone[0]].deep + at[bone[1]].deep) / 2, bone: bone, colour: given.colours[i],
    }));
    const palm = given.palm.map((i) => at[i]);
    things.push({ deep: palm.reduce((sum, p) => sum + p.deep, 0) / palm.length + 0.03, palm: palm });
    things.sort((a, b) => b.deep - a.deep);
    pen.lineCap = pen.lineJoin = "round";
    for (const thing of things) {
      if (thing.palm) {
        pen.beginPath();
        thing.palm.forEach((p, i) => (i ? pen.lineTo(p.x, p.y) : pen.moveTo(p.x, p.y)));
        pen.closePath();
        pen.fillStyle = pen.strokeStyle = shaded("#c9cdd4", thing.deep);
        pen.lineWidth = 0.016 * palm[0].scale;
        pen.fill(); pen.stroke();
        continue;
      }
      const [a, b] = thing.bone.map((i) => at[i]);
      pen.beginPath(); pen.moveTo(a.x, a.y); pen.lineTo(b.x, b.y);
      pen.lineWidth = 0.0145 * (a.scale + b.scale) / 2;
      pen.strokeStyle = "rgba(255,255,255,.9)"; pen.stroke();
      pen.lineWidth *= 0.84;
      pen.strokeStyle = shaded(thing.colour, thing.deep); pen.stroke();
    }
  }
  function show() {
    const second = given.begin + Math.floor(frame) / given.hz;
    slider.value = Math.floor(frame);
    clock.textContent = second.toFixed(2) + " s";
    for (const line of document.querySelectorAll("line.now")) {
      const d = line.dataset, share = (second - d.t0) / Math.max(d.t1 - d.t0, 1e-6);
      const x = +d.x0 + Math.min(Math.max(share, 0), 1) * (d.x1 - d.x0);
      line.setAttribute("x1", x); line.setAttribute("x2", x);
    }
    draw();
  }
  function tick(now) {
    if (!playing) return;
    frame += Math.min((now - last) / 1000, 0.2) * given.hz * +speed.value;
    if (frame >= given.frames) frame = 0;
    last = now;
    show();
    requestAnimationFrame(tick);
  }
  function play(on) {
    playing = on;
    button.textContent = on ? button.dataset.pause : button.dataset.play;
    last = performance.now();
    if (on) requestAnimationFrame(tick);
  }
  button.addEventListener("click", () => play(!playing));
  slider.addEventListener("input", () => { play(false); frame = +slider.value; show(); });
  let held = null;
  canvas.addEventListener("pointerdown", (e) => { held = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener("pointerup", () => { held = null; });
  canvas.addEventListener("pointermove", (e) => {
    if (!held) return;
    turn += (e.clientX - held[0]) * 0.01;
    tilt = Math.min(1.57, Math.max(-1.57, tilt + (e.clientY - held[1]) * 0.01));
    held = [e.clientX, e.clientY];
    draw();
  });
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    zoom = Math.min(4, Math.max(0.4, zoom * Math.exp(-0.001 * e.deltaY)));
    draw();
  }, { passive: false });
  window.addEventListener("resize", draw);
  window.addEventListener("beforeprint", draw);
  frame = given.frames >> 1;
  show();
})();
