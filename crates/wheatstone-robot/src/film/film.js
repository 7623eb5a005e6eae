// Plays a film: pictures with what was matched in them, the map as it grew, the ways meant and gone.
"use strict";
(() => {
  const body = document.body;
  let errors = 0;
  const fail = () => { body.dataset.errors = String(++errors); };
  window.addEventListener("error", fail);
  window.addEventListener("unhandledrejection", fail);
  document.addEventListener("securitypolicyviolation", fail);

  const reel = JSON.parse(document.getElementById("data").textContent);
  const { frames, world, outcome } = reel;
  const element = (id) => document.getElementById(id);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const last = frames.length - 1;

  // Colours come from the page's style, and change with it.
  let colour = {};
  const readColours = () => {
    const style = getComputedStyle(body);
    for (const name of ["corner", "floor", "standing", "map-free", "map-none", "map-taken", "path", "trust", "planned", "goal", "ink", "rule", "doubtful", "muted", "paper"])
      colour[name] = style.getPropertyValue("--" + name).trim();
  };

  // A canvas as sharp as the screen; gives its context in CSS pixels.
  const sharp = (canvas) => {
    const { width, height } = canvas.getBoundingClientRect();
    const ratio = window.devicePixelRatio || 1;
    const [w, h] = [Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio))];
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const g = canvas.getContext("2d");
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, width, height);
    return { g, width, height };
  };

  // Marks of a look: kind, pixels in both pictures, distance and height in centimetres.
  const decoded = new Map();
  const marksOf = (index) => {
    if (decoded.has(index)) return decoded.get(index);
    const view = new DataView(bytes(frames[index].marks).buffer);
    const marks = [];
    for (let at = 0; at < view.byteLength; at += 13) {
      const value = (place) => view.getUint16(at + 1 + 2 * place, true) / 10;
      marks.push({ kind: view.getUint8(at), pixels: [[value(0), value(1)], [value(2), value(3)]], away: value(4), height: value(5) - 100 });
    }
    if (decoded.size > 60) decoded.clear();
    decoded.set(index, marks);
    return marks;
  };

  // The map up to a look; forward by what changed, backward from the beginning.
  const { columns, rows, cell, corner } = reel.map;
  const cells = new Uint8Array(columns * rows);
  let mapAt = -1;
  const apply = (code) => {
    let [at, number, shift] = [-1, 0, 1];
    for (const byte of bytes(code)) {
      number += (byte & 127) * shift;
      shift *= 128;
      if (byte & 128) continue;
      at += Math.floor(number / 3);
      cells[at] = number % 3;
      [number, shift] = [0, 1];
    }
  };
  const mapTo = (index) => {
    if (index < mapAt) { cells.fill(0); mapAt = -1; }
    while (mapAt < index) frames[++mapAt].map.forEach(apply);
  };

  let now = 0;
  let pointed = null;
  const eyes = ["left", "right"].map((name) => ({ image: element(name), canvas: element(name + "-marks") }));
  const shows = [0, 1, 2].map((kind) => element("show-" + kind));

  const drawMark = (g, mark, [x, y], size) => {
    g.beginPath();
    if (mark.kind === 0) { g.arc(x, y, size, 0, 2 * Math.PI); g.stroke(); }
    else if (mark.kind === 1) { g.moveTo(x - size * 0.8, y); g.lineTo(x + size * 0.8, y); g.stroke(); }
    else { g.moveTo(x, y - size * 0.8); g.lineTo(x + size * 0.75, y + size * 0.6); g.lineTo(x - size * 0.75, y + size * 0.6); g.fill(); }
  };
  const colourOf = (mark) => colour[["corner", "floor", "standing"][mark.kind]];
  const drawMarks = () => {
    eyes.forEach(({ canvas }, eye) => {
      const { g, width } = sharp(canvas);
      const scale = width / reel.size[0];
      const size = Math.max(2.2, 6 * scale);
      const place = (mark) => mark.pixels[eye].map((value) => (value + 0.5) * scale);
      for (const mark of marksOf(now)) {
        if (!shows[mark.kind].checked) continue;
        g.strokeStyle = g.fillStyle = colourOf(mark);
        g.lineWidth = mark.kind === 1 ? 1.8 : 1.4;
        drawMark(g, mark, place(mark), mark.kind === 0 ? size : size * 0.75);
      }
      if (!pointed) return;
      for (const [line, width] of [["#000", 5], ["#fff", 2.5]]) {
        g.strokeStyle = line; g.lineWidth = width;
        g.beginPath(); g.arc(...place(pointed), 9, 0, 2 * Math.PI); g.stroke();
      }
    });
  };
  eyes.forEach(({ canvas }, eye) => {
    const seek = (event) => {
      const box = canvas.getBoundingClientRect();
      const scale = box.width / reel.size[0];
      const at = [(event.clientX - box.left) / scale, (event.clientY - box.top) / scale];
      const off = (mark) => Math.hypot(mark.pixels[eye][0] - at[0], mark.pixels[eye][1] - at[1]);
      pointed = null;
      for (const mark of marksOf(now)) if (shows[mark.kind].checked && off(mark) < (pointed ? off(pointed) : 16 / scale)) pointed = mark;
      drawMarks(); tellPointed();
    };
    canvas.addEventListener("pointermove", seek);
    canvas.addEventListener("pointerdown", seek);
    canvas.addEventListener("pointerleave", () => { pointed = null; drawMarks(); tellPointed(); });
  });
  const hint = element("pointed").textContent;
  const tellPointed = () => {
    element("pointed").textContent = pointed
      ? `${["A corner", "An edge of the floor", "An edge of an obstacle"][pointed.kind]}: ${pointed.away.toFixed(1)} cm ahead, ${pointed.height.toFixed(1)} cm above the floor.`
      : hint;
  };

  // The map, with what is true drawn over what is believed; ahead is up.
  const [wallLeft, wallRight, wallBehind, wallAhead] = world.walls;
  const rim = 12;
  const span = [wallRight - wallLeft + 2 * rim, wallAhead - wallBehind + 2 * rim];
  const raster = document.createElement("canvas");
  [raster.width, raster.height] = [columns, rows];
  const rgb = (text) => { const probe = document.createElement("canvas").getContext("2d"); probe.fillStyle = text; probe.fillRect(0, 0, 1, 1); return probe.getImageData(0, 0, 1, 1).data; };
  let palette = null;
  const drawCells = () => {
    const g = raster.getContext("2d");
    const image = g.createImageData(columns, rows);
    palette ||= ["map-none", "map-free", "map-taken"].map((name) => rgb(colour[name]));
    for (let index = 0; index < cells.length; index++) {
      const row = rows - 1 - Math.floor(index / columns);
      image.data.set(palette[cells[index]], 4 * (row * columns + (index % columns)));
    }
    g.putImageData(image, 0, 0);
  };
  const outlineOf = (obstacle) => {
    const [x, z] = obstacle.centre;
    const path = [];
    const radius = obstacle.footprint.cylinder;
    if (radius !== undefined) {
      for (let turn = 0; turn < 40; turn++) path.push([x + radius * Math.sin((turn * Math.PI) / 20), z + radius * Math.cos((turn * Math.PI) / 20)]);
      return path;
    }
    const [half, deep] = obstacle.footprint.box;
    const [sine, cosine] = [Math.sin(obstacle.turn), Math.cos(obstacle.turn)];
    for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) path.push([x + a * half * cosine + b * deep * sine, z - a * half * sine + b * deep * cosine]);
    return path;
  };
  const outlines = world.obstacles.map(outlineOf);
  outlines.push([[wallLeft, wallBehind], [wallRight, wallBehind], [wallRight, wallAhead], [wallLeft, wallAhead]]);

  const drawMap = () => {
    const canvas = element("map");
    canvas.style.aspectRatio = `${span[0]} / ${span[1]}`;
    canvas.style.width = `min(100%, max(20rem, 100vh - 21rem) * ${span[0] / span[1]})`;
    const { g, width } = sharp(canvas);
    const scale = width / span[0];
    const to = ([x, z]) => [(x - wallLeft + rim) * scale, (wallAhead + rim - z) * scale];
    const stroke = (path, style, line, dash, closed) => {
      g.strokeStyle = style; g.lineWidth = line; g.setLineDash(dash || []);
      g.beginPath();
      path.forEach((point, index) => (index ? g.lineTo(...to(point)) : g.moveTo(...to(point))));
      if (closed) g.closePath();
      g.stroke(); g.setLineDash([]);
    };
    drawCells();
    g.imageSmoothingEnabled = false;
    g.drawImage(raster, ...to([corner[0], corner[1] + rows * cell]), columns * cell * scale, rows * cell * scale);
    outlines.forEach((path) => stroke(path, colour.ink, 1.5, [], true));
    const frame = frames[now];
    const before = frames.slice(0, now + 1);
    stroke(before.map((f) => f.truth), colour.path, 2);
    stroke(before.map((f) => f.believed), colour.trust, 2, [5, 3]);
    if (frame.way.length > 1) stroke(frame.way, colour.planned, 2.6, [2, 4]);
    const cross = 5 / scale;
    const [gx, gz] = world.goal;
    stroke([[gx - cross, gz - cross], [gx + cross, gz + cross]], colour.goal, 3);
    stroke([[gx - cross, gz + cross], [gx + cross, gz - cross]], colour.goal, 3);
    for (const [pose, style, dash] of [[frame.truth, colour.path, []], [frame.believed, colour.trust, [5, 3]]]) {
      const [x, z, heading] = pose;
      g.strokeStyle = style; g.lineWidth = 2; g.setLineDash(dash);
      g.beginPath(); g.arc(...to([x, z]), world.robot * scale, 0, 2 * Math.PI); g.stroke();
      stroke([[x, z], [x + world.robot * Math.sin(heading), z + world.robot * Math.cos(heading)]], style, 2.5);
    }
  };

  // How it went, over the whole film.
  const drawStrip = () => {
    const { g, width, height } = sharp(element("strip"));
    const part = width / frames.length;
    g.fillStyle = colour.rule;
    g.fillRect(0, 0, width, height);
    frames.forEach((frame, index) => {
      if (frame.trust === "broken") { g.fillStyle = colour.doubtful; g.fillRect(index * part, 0, Math.max(part, 1), height); }
      else if (!frame.found) { g.fillStyle = colour.muted; g.fillRect(index * part, height / 2, Math.max(part, 1), height / 2); }
    });
  };

  const list = (id, pairs) => {
    const rows = pairs.flatMap(([name, value]) => {
      const [dt, dd] = [document.createElement("dt"), document.createElement("dd")];
      dt.textContent = name; dd.textContent = value;
      return [dt, dd];
    });
    element(id).replaceChildren(...rows);
  };
  const off = (frame) => Math.hypot(frame.truth[0] - frame.believed[0], frame.truth[1] - frame.believed[1]);
  const toGoal = (frame) => Math.hypot(frame.truth[0] - world.goal[0], frame.truth[1] - world.goal[1]);
  const turned = (degrees) => (Math.abs(degrees) < 0.05 ? "straight" : `${Math.abs(degrees).toFixed(1)}° ${degrees > 0 ? "right" : "left"}`);
  const tell = () => {
    const frame = frames[now];
    element("activity").textContent = frame.activity + ":";
    element("why").textContent = frame.why;
    const complaint = element("complaint");
    complaint.hidden = !frame.complaint;
    complaint.textContent = frame.complaint ? (frame.trust === "broken" ? "Pictures contradict the calibration: " : "Pictures say little: ") + frame.complaint : "";
    list("facts", [
      ["Command", frame.command ? `${frame.command[0].toFixed(1)} cm/s` : "none"],
      ["Turn in a second", frame.command ? turned(frame.command[1]) : "none"],
      ["Own motion", frame.found ? "found" : "not found"],
      ["Pictures", frame.trust],
      ["Believed place off by", `${off(frame).toFixed(1)} cm`],
      ["To the goal", `${toGoal(frame).toFixed(0)} cm`],
    ]);
    frame.counts.forEach((count, kind) => { element("count-" + kind).textContent = String(count); });
    element("at").textContent = `look ${frame.number} of ${frames[last].number}`;
    const scrub = element("scrub");
    scrub.value = String(now);
    scrub.setAttribute("aria-valuetext", `look ${frame.number} of ${frames[last].number}: ${frame.activity}`);
    element("map").setAttribute("aria-label", `Map at look ${frame.number}: the robot is ${toGoal(frame).toFixed(0)} cm from the goal and believes itself ${off(frame).toFixed(1)} cm from where it is.`);
    const seen = `${frame.counts[0]} corners, ${frame.counts[1]} edges of the floor and ${frame.counts[2]} of obstacles found in both pictures`;
    eyes.forEach(({ image }, eye) => { image.alt = `${["Left", "Right"][eye]} camera at look ${frame.number}; ${seen}.`; });
    // Who listens hears it once it stands still.
    element("live").textContent = timer ? "" : `Look ${frame.number}. ${frame.activity}: ${frame.why}.`;
  };
  const show = (index) => {
    now = Math.max(0, Math.min(last, index));
    pointed = null;
    mapTo(now);
    eyes.forEach(({ image }, eye) => { image.src = frames[now].pictures[eye]; });
    tell(); tellPointed(); drawMarks(); drawMap();
  };

  // Playing: nothing moves before somebody asks for it.
  let timer = 0;
  const play = element("play");
  const pause = () => { clearTimeout(timer); timer = 0; play.textContent = "Play"; tell(); };
  const next = () => {
    if (now >= last) return pause();
    show(now + 1);
    timer = setTimeout(next, (250 * reel.every) / Number(element("speed").value));
  };
  const toggle = () => {
    if (timer) return pause();
    play.textContent = "Pause";
    if (now >= last) show(0);
    timer = setTimeout(next, 0);
  };
  const go = (index) => { if (timer) pause(); show(index); };
  play.addEventListener("click", toggle);
  const keys = { first: () => 0, back: () => now - 1, forward: () => now + 1, last: () => last };
  for (const [id, target] of Object.entries(keys)) element(id).addEventListener("click", () => go(target()));
  element("scrub").max = String(last);
  element("scrub").addEventListener("input", (event) => go(Number(event.target.value)));
  shows.forEach((box) => box.addEventListener("change", drawMarks));
  document.addEventListener("keydown", (event) => {
    const inside = event.target.tagName;
    if (event.ctrlKey || event.altKey || event.metaKey || inside === "SELECT") return;
    const far = event.shiftKey ? 10 : 1;
    const target = { ArrowLeft: now - far, ArrowRight: now + far, Home: 0, End: last }[event.key];
    if (event.key === " " && inside !== "BUTTON" && event.target.type !== "checkbox") { event.preventDefault(); toggle(); }
    else if (target !== undefined) { event.preventDefault(); go(target); }
  });

  // Light or dark: as the system has it until the reader chooses.
  const system = matchMedia("(prefers-color-scheme: dark)");
  const theme = element("theme");
  const isDark = () => (document.documentElement.dataset.theme || (system.matches ? "dark" : "light")) === "dark";
  const dressed = () => { theme.textContent = isDark() ? "Light" : "Dark"; palette = null; readColours(); drawMarks(); drawMap(); drawStrip(); };
  theme.addEventListener("click", () => { document.documentElement.dataset.theme = isDark() ? "light" : "dark"; dressed(); });
  system.addEventListener("change", dressed);
  theme.hidden = false;

  list("result", [
    ["World", String(reel.seed)], ["Method", reel.method], ["Obstacles", String(world.obstacles.length)],
    ["Reached the goal", outcome.reached ? "yes" : "no"], ["Ran into something", outcome.collided ? "yes" : "no"],
    ["Least clearance", `${outcome.clearance.toFixed(1)} cm`], ["Looks", String(outcome.steps)],
    ["Motion not found in", String(outcome.lost)], ["Place off by", `${outcome.position_error.toFixed(1)} cm`],
    ["From the goal", `${outcome.goal_distance.toFixed(1)} cm`],
    ["Map off by (median)", `${outcome.map_error.median.toFixed(1)} cm`],
    ...(outcome.noticed ? [["Mishap before look", String(outcome.noticed.at)], ["Noticed after", outcome.noticed.after === null ? "never" : `${outcome.noticed.after} looks`]] : []),
  ]);
  readColours();
  if (frames.length) {
    show(0); dressed();
    new ResizeObserver(() => { drawMarks(); drawMap(); drawStrip(); }).observe(element("player"));
  }
  body.dataset.ready = "yes";
})();
