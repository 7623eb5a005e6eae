// The 3-D view. Places are shown in the cameras' common frame: right, up, and towards the reader.
"use strict";
(() => {
  const { data, element, figure } = page;
  const body = document.body;
  const done = (state) => { body.dataset.ready = state; };
  const probe = document.createElement("canvas").getContext("webgl2");
  if (!data.scene || !probe) { done("static"); return; }
  const lose = probe.getExtension("WEBGL_lose_context");
  if (lose) lose.loseContext();

  const scene3 = data.scene;
  const count = scene3.count;
  const world = page.floats(scene3.world), error = page.floats(scene3.error);
  const pixels = page.floats(scene3.pixels), misses = page.floats(scene3.misses);
  const promised = page.floats(scene3.promised), residual = page.floats(scene3.residual);
  const covariance = scene3.covariance ? page.floats(scene3.covariance) : null;
  const view = new Uint16Array(page.bytes(scene3.view));
  const original = scene3.original ? new Uint32Array(page.bytes(scene3.original)) : null;
  const number = (index) => (original ? original[index] : index);
  const compact = original ? new Map(Array.from(original, (value, index) => [value, index])) : null;
  const cameras = data.cameras;
  const [right, up, forward] = scene3.basis;
  const dot = (a, x, y, z) => a[0] * x + a[1] * y + a[2] * z;

  // To the frame of the view, where the scene has about the size of 1.
  const size = scene3.extent || 1;
  const turn = (x, y, z) => [dot(right, x, y, z) / size, dot(up, x, y, z) / size, -dot(forward, x, y, z) / size];
  const place = new Float32Array(3 * count), shift = new Float32Array(3 * count), length = new Float32Array(count);
  for (let i = 0; i < count; i++) {
    place.set(turn(world[3 * i], world[3 * i + 1], world[3 * i + 2]), 3 * i);
    const e = [error[3 * i], error[3 * i + 1], error[3 * i + 2]];
    length[i] = Math.hypot(...e);
    shift.set(Number.isNaN(e[0]) ? [0, 0, 0] : turn(...e), 3 * i);
  }
  // Points of one camera alone have a known place only: they are drawn as rings.
  const seenBy = (i) => cameras.reduce((sum, _, k) => sum + (Number.isNaN(pixels[2 * (i * cameras.length + k)]) ? 0 : 1), 0);
  const single = Array.from({ length: count }, (_, i) => cameras.length > 1 && seenBy(i) === 1);
  const order = Array.from({ length: count }, (_, i) => i);
  order.sort((a, b) => (Number.isNaN(length[a]) ? -1 : length[b]) - (Number.isNaN(length[b]) ? -1 : length[a]) || a - b);

  const canvas = element("canvas"), stage = element("stage");
  for (const part of document.querySelectorAll("#scene .live")) part.hidden = false;
  for (const part of document.querySelectorAll("#scene .still")) part.hidden = true;
  const renderer = new THREE.WebGLRenderer({ canvas, antialias: count < 2000, alpha: true });
  const scene = new THREE.Scene();
  const eye = new THREE.PerspectiveCamera(40, 1, 0.001, 100);
  const orbit = new THREE.OrbitControls(eye, canvas);
  orbit.enableDamping = false;
  orbit.enableZoom = false;
  canvas.style.touchAction = "pan-y";
  scene.add(new THREE.AmbientLight(0xffffff, 2));
  const sun = new THREE.DirectionalLight(0xffffff, 2);
  sun.position.set(1, 2, 3);
  scene.add(sun);

  let moving = false, rest = 0;
  const stir = () => {
    moving = true;
    clearTimeout(rest);
    rest = setTimeout(() => { moving = false; ask(); }, 160);
    ask();
  };
  let asked = false;
  const ask = () => { if (!asked) { asked = true; requestAnimationFrame(draw); } };

  // Points and errors: one geometry, moved by the exaggeration on the graphics side.
  const uniforms = { exaggeration: { value: 1 }, size: { value: 5 }, flat: { value: new THREE.Color() }, rim: { value: new THREE.Color() }, tinted: { value: 1 } };
  const vertex = `attribute vec3 shift; attribute vec3 tint; attribute float along;
    uniform float exaggeration; uniform float size; varying vec3 colour;
    void main() { colour = tint; vec4 at = modelViewMatrix * vec4(position + shift * exaggeration * along, 1.0);
      gl_Position = projectionMatrix * at; gl_PointSize = size; }`;
  const fragment = (round, hollow) => `uniform vec3 flat_; uniform vec3 rim; uniform float tinted; varying vec3 colour;
    void main() { vec3 c = mix(flat_, colour, tinted);
      ${round ? "vec2 p = gl_PointCoord - 0.5; float d = dot(p, p); if (d > 0.25) discard; if (d > 0.14 && tinted > 0.5) c = mix(c, rim, 0.5);" : ""}
      ${hollow ? "if (d < 0.11) discard; c = vec3(0.8, 0.475, 0.655);" : ""}
      gl_FragColor = vec4(c, 1.0); }`;
  const material = (round, tinted, pointSize, hollow = false) => new THREE.ShaderMaterial({
    vertexShader: vertex, fragmentShader: fragment(round, hollow),
    uniforms: { exaggeration: uniforms.exaggeration, size: { value: pointSize * devicePixelRatio }, flat_: uniforms.flat, rim: uniforms.rim, tinted: { value: tinted } },
  });
  const attribute = (array, of) => new THREE.BufferAttribute(array, of);
  const geometry = (along, index) => {
    const g = new THREE.BufferGeometry();
    g.setAttribute("position", attribute(place, 3));
    g.setAttribute("shift", attribute(shift, 3));
    g.setAttribute("tint", tints);
    g.setAttribute("along", attribute(new Float32Array(count).fill(along), 1));
    g.setIndex(attribute(index, 1));
    return g;
  };
  // In random order, so that the first ones stand for all while the view turns.
  const shuffled = Uint32Array.from({ length: count }, (_, i) => i);
  for (let i = count - 1, seed = 1; i > 0; i--) {
    seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
    const j = seed % (i + 1);
    [shuffled[i], shuffled[j]] = [shuffled[j], shuffled[i]];
  }
  const MOST_MOVING = 6000;
  const tint = new Float32Array(3 * count);
  const tints = attribute(tint, 3);
  const dense = count > 5000;
  const known = new THREE.Points(geometry(0, shuffled), material(true, 0, dense ? 2 : 4));
  const located = new THREE.Points(geometry(1, shuffled.filter((i) => !single[i])), material(true, 1, dense ? 4 : 8));
  const alone = shuffled.filter((i) => single[i]);
  const singles = new THREE.Points(geometry(0, alone), material(true, 0, dense ? 6 : 9, true));
  const twice = (array, of) => {
    const out = new Float32Array(2 * array.length);
    for (let i = 0; i < count; i++) for (let k = 0; k < of; k++) out[2 * of * i + k] = out[2 * of * i + of + k] = array[of * i + k];
    return out;
  };
  const strokes = new THREE.BufferGeometry();
  const strokeTints = attribute(new Float32Array(6 * count), 3);
  strokes.setAttribute("position", attribute(twice(place, 3), 3));
  strokes.setAttribute("shift", attribute(twice(shift, 3), 3));
  strokes.setAttribute("tint", strokeTints);
  strokes.setAttribute("along", attribute(Float32Array.from({ length: 2 * count }, (_, i) => i % 2), 1));
  const errors = new THREE.LineSegments(strokes, material(false, 1, 1));
  for (const object of [known, located, singles, errors]) { object.frustumCulled = false; scene.add(object); }

  // Cameras as pyramids.
  const inCentre = (p) => turn(p[0] - scene3.centre[0], p[1] - scene3.centre[1], p[2] - scene3.centre[2]);
  const frusta = [], stands = [];
  for (const camera of cameras) {
    if (!camera.centre) { stands.push(null); continue; }
    const from = inCentre(camera.centre);
    stands.push(new THREE.Vector3(...from));
    const reach = 0.16;
    const ends = camera.corners.map((c) => turn(c[0] * size * reach, c[1] * size * reach, c[2] * size * reach).map((v, k) => v + from[k]));
    ends.forEach((end, k) => { frusta.push(...from, ...end, ...end, ...ends[(k + 1) % ends.length]); });
    // A mark on the upper edge, so that upside-down cameras show.
    if (ends.length === 4) {
      const middle = ends[0].map((v, k) => (v + ends[1][k]) / 2), low = ends[3].map((v, k) => (v + ends[2][k]) / 2);
      const tip = middle.map((v, k) => v + (v - low[k]) * 0.25);
      frusta.push(...ends[0], ...tip, ...tip, ...ends[1]);
    }
  }
  const lines = (positions, colour) => {
    const g = new THREE.BufferGeometry();
    g.setAttribute("position", attribute(new Float32Array(positions), 3));
    const object = new THREE.LineSegments(g, new THREE.LineBasicMaterial({ color: colour }));
    object.frustumCulled = false;
    scene.add(object);
    return object;
  };
  const pyramids = lines(frusta, 0x000000);
  const sights = lines(new Array(6 * cameras.length).fill(0), 0xd55e00);
  sights.visible = false;
  const named = (text, kind) => {
    const label = document.createElement("span");
    label.className = kind; label.textContent = text;
    stage.append(label);
    return label;
  };
  const labels = cameras.map((camera, k) => {
    const label = named(camera.name, "label");
    label.hidden = !stands[k];
    return label;
  });

  // The axes of the world, and a bar as long as each.
  const axes = scene3.axes, tips = [], axisLines = [];
  if (axes) {
    const begin = turn(...axes.from);
    for (let k = 0; k < 3; k++) {
      const tip = turn(...axes.from.map((v, axis) => v + (axis === k ? axes.length : 0)));
      axisLines.push(...begin, ...tip);
      // Its name stands a little beyond its end.
      tips.push(new THREE.Vector3(...tip.map((v, axis) => v + 0.14 * (v - begin[axis]))));
    }
    element("length-name").textContent = figure(axes.length) + " " + data.unit;
  }
  const tripod = lines(axisLines, 0x000000);
  const axisNames = axes ? ["X", "Y", "Z"].map((name) => named(name, "label axis")) : [];

  // Ellipsoids: the unit sphere through the Cholesky factor of each covariance.
  const held = covariance ? scene3.ellipsoids : 0;
  let ellipsoids = null;
  const factor = (i) => {
    const [xx, xy, xz, yy, yz, zz] = covariance.subarray(6 * i, 6 * i + 6);
    const full = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    const axes = [right, up, forward.map((v) => -v)];
    const c = axes.map((a) => axes.map((b) => { let sum = 0; for (let r = 0; r < 3; r++) for (let s = 0; s < 3; s++) sum += a[r] * full[r][s] * b[s]; return sum / size / size; }));
    const a = Math.sqrt(c[0][0]), b = c[1][0] / a, d = c[2][0] / a;
    const e = Math.sqrt(c[1][1] - b * b), f = (c[2][1] - d * b) / e, h = Math.sqrt(c[2][2] - d * d - f * f);
    return [a, b, d, e, f, h].every(Number.isFinite) ? [a, b, d, e, f, h] : null;
  };
  const makeEllipsoids = () => {
    ellipsoids = new THREE.InstancedMesh(new THREE.IcosahedronGeometry(1, held > 100 ? 1 : 2),
      new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.38, depthWrite: false }), held);
    ellipsoids.frustumCulled = false;
    ellipsoids.factors = Array.from({ length: held }, (_, i) => factor(i));
    scene.add(ellipsoids);
    placeEllipsoids(); paint();
  };
  const placeEllipsoids = () => {
    if (!ellipsoids) return;
    const k = uniforms.exaggeration.value, m = new THREE.Matrix4();
    for (let i = 0; i < held; i++) {
      const l = ellipsoids.factors[i];
      const at = [0, 1, 2].map((axis) => place[3 * i + axis] + shift[3 * i + axis] * k);
      if (l) m.set(l[0] * k, 0, 0, at[0], l[1] * k, l[3] * k, 0, at[1], l[2] * k, l[4] * k, l[5] * k, at[2], 0, 0, 0, 1);
      else m.makeScale(0, 0, 0);
      ellipsoids.setMatrixAt(i, m);
    }
    ellipsoids.instanceMatrix.needsUpdate = true;
  };

  // Colours.
  const cividis = [0x00224e, 0x123570, 0x3b496c, 0x575d6d, 0x707173, 0x8a8678, 0xa59c74, 0xc3b369, 0xe1cc55, 0xfee838].map((hex) => new THREE.Color(hex).convertLinearToSRGB());
  const okabe = [0x0072b2, 0xd55e00, 0x009e73, 0xcc79a7, 0xe69f00, 0x56b4e9].map((hex) => new THREE.Color(hex).convertLinearToSRGB());
  const sorted = Array.from(length).filter(Number.isFinite).sort((a, b) => a - b);
  const most = sorted.length ? sorted[Math.floor(0.98 * (sorted.length - 1))] || 1 : 1;
  const colourOf = (i, mode) => {
    if (mode === "view") return okabe[view[i] % okabe.length];
    const share = mode === "ratio" ? length[i] / promised[i] / 3 : length[i] / most;
    const at = Math.min(1, Math.max(0, share || 0)) * (cividis.length - 1), low = Math.min(cividis.length - 2, Math.floor(at));
    return mixed.copy(cividis[low]).lerp(cividis[low + 1], at - low);
  };
  const mixed = new THREE.Color();
  const paint = () => {
    const mode = element("colour").value;
    for (let i = 0; i < count; i++) {
      const c = colourOf(i, mode);
      tint[3 * i] = c.r; tint[3 * i + 1] = c.g; tint[3 * i + 2] = c.b;
      for (const k of [6 * i, 6 * i + 3]) { strokeTints.array[k] = c.r; strokeTints.array[k + 1] = c.g; strokeTints.array[k + 2] = c.b; }
      if (ellipsoids && i < held) ellipsoids.setColorAt(i, mixed.setRGB(c.r, c.g, c.b).convertSRGBToLinear());
    }
    tints.needsUpdate = strokeTints.needsUpdate = true;
    if (ellipsoids && ellipsoids.instanceColor) ellipsoids.instanceColor.needsUpdate = true;
    element("scale").hidden = mode === "view";
    element("scale-low").textContent = "0";
    element("scale-high").textContent = mode === "ratio" ? "3 × what was promised" : figure(most) + " " + data.unit;
    ask();
  };
  const dress = () => {
    const ink = getComputedStyle(body).getPropertyValue("color");
    const muted = getComputedStyle(document.documentElement).getPropertyValue("--muted").trim();
    pyramids.material.color.set(ink);
    tripod.material.color.set(ink);
    uniforms.rim.value.set(ink).convertLinearToSRGB();
    uniforms.flat.value.set(muted).convertLinearToSRGB();
    ask();
  };
  page.onTheme(dress);

  // Where the eye goes: to the right of the cameras and above them, as near as all of it fits.
  const from = new THREE.Vector3(0.78, 0.5, 0.62).normalize();
  const across = new THREE.Vector3(0, 1, 0).cross(from).normalize(), above = from.clone().cross(across);
  const visible = stands.filter(Boolean);
  const some = [];
  for (let i = 0; i < count; i += Math.ceil(count / 5000)) {
    const p = new THREE.Vector3(...place.subarray(3 * i, 3 * i + 3));
    if (Number.isFinite(p.x)) some.push(p);
  }
  const distant = visible.some((stand) => stand.length() > 6);
  const look = (whole) => {
    const all = whole ? some.concat(visible) : some;
    const ends = [across, above, from].map((axis) => all.map((p) => p.dot(axis)).reduce(([l, h], v) => [Math.min(l, v), Math.max(h, v)], [Infinity, -Infinity]));
    orbit.target.set(0, 0, 0);
    [across, above, from].forEach((axis, k) => orbit.target.addScaledVector(axis, (ends[k][0] + ends[k][1]) / 2));
    const slope = Math.tan((eye.fov * Math.PI) / 360) * 0.86;
    let distance = 0.2;
    for (const p of all) {
      const v = p.clone().sub(orbit.target);
      distance = Math.max(distance, v.dot(from) + Math.max(Math.abs(v.dot(across)) / eye.aspect, Math.abs(v.dot(above))) / slope);
    }
    eye.position.copy(orbit.target).addScaledVector(from, distance);
    orbit.update(); ask();
  };
  const home = () => look(!distant);

  const wanted = { known: true, located: true, single: true, errors: true, ellipsoids: false };
  let frames = 0, sized = false;
  const at = new THREE.Vector3();
  function draw() {
    asked = false;
    if (!sized) return;
    const few = moving && count > MOST_MOVING;
    located.geometry.setDrawRange(0, few ? MOST_MOVING : count);
    singles.visible = wanted.single;
    known.geometry.setDrawRange(0, few ? MOST_MOVING : count);
    known.visible = wanted.known && !(few && wanted.located);
    errors.visible = wanted.errors && !few;
    if (ellipsoids) ellipsoids.visible = wanted.ellipsoids && !(moving && held > 250);
    located.material.uniforms.size.value = (dense ? 4 : wanted.ellipsoids ? 4 : 8) * devicePixelRatio;
    renderer.render(scene, eye);
    frames += 1;
    body.dataset.frames = String(frames);
    const taken = [];
    labels.forEach((label, k) => {
      if (!stands[k]) return;
      at.copy(stands[k]).project(eye);
      label.hidden = !pyramids.visible || at.z > 1;
      if (label.hidden) return;
      const x = ((at.x + 1) / 2) * stage.clientWidth + 8, wide = label.textContent.length * 8 + 16;
      let y = ((1 - at.y) / 2) * stage.clientHeight + 6;
      // Names that would hide each other stand one below the other.
      while (taken.some((other) => Math.abs(other.y - y) < 22 && x < other.x + other.wide && other.x < x + wide)) y += 23;
      taken.push({ x, y, wide });
      label.style.transform = `translate(${x}px, ${y}px)`;
    });
    axisNames.forEach((label, k) => {
      at.copy(tips[k]).project(eye);
      label.hidden = !tripod.visible || at.z > 1;
      const x = ((at.x + 1) / 2) * stage.clientWidth - 5, y = ((1 - at.y) / 2) * stage.clientHeight - 10;
      label.style.transform = `translate(${x}px, ${y}px)`;
    });
    if (axes) {
      const high = 2 * eye.position.distanceTo(orbit.target) * Math.tan((eye.fov * Math.PI) / 360);
      element("length").hidden = !tripod.visible;
      element("length").firstChild.style.width = `${(axes.length / size / high) * stage.clientHeight}px`;
    }
    if (frames === 1) {
      const gl = renderer.getContext(), [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight], out = new Uint8Array(4 * w * h);
      gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, out);
      let painted = 0;
      for (let k = 3; k < out.length; k += 4) if (out[k] > 0) painted += 1;
      body.dataset.painted = String(painted);
      done("3d");
    }
  }
  const fit = () => {
    const [w, h] = [stage.clientWidth, stage.clientHeight];
    if (!w || !h) return;
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(w, h, false);
    eye.aspect = w / h; eye.updateProjectionMatrix();
    if (!sized) { sized = true; home(); }
    draw();
  };
  new ResizeObserver(fit).observe(stage);
  orbit.addEventListener("change", stir);

  // Choosing points.
  let hovered = -1, selected = -1;
  const title = (i) => {
    const name = data.views[view[i]], id = scene3.ids ? scene3.ids[i] : null;
    return "Point " + (id === null || id === undefined ? number(i) + 1 : id) + (name === undefined ? "" : ", view " + name);
  };
  const words = (i) => title(i) + (Number.isNaN(length[i]) ? "" : ": " + figure(length[i]) + " " + data.unit);
  const fact = (list, name, value) => {
    const dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = name; dd.textContent = value; list.append(dt, dd);
  };
  const show = (i) => {
    const facts = element("facts"), crops = element("crops"), unit = " " + data.unit;
    facts.replaceChildren(); crops.replaceChildren();
    element("point-title").textContent = i < 0 ? "No point selected" : title(i);
    element("point-hint").hidden = i >= 0;
    element("next").textContent = selected < 0 ? "Largest error" : "Next smaller";
    sights.visible = i >= 0;
    if (i < 0) { ask(); return; }
    fact(facts, "error", figure(length[i]) + unit);
    fact(facts, "promised", figure(promised[i]) + unit);
    ["X", "Y", "Z"].forEach((axis, k) => fact(facts, "along " + axis, figure(error[3 * i + k]) + unit));
    ["X", "Y", "Z"].forEach((axis, k) => fact(facts, axis, figure(world[3 * i + k] + scene3.centre[k]) + unit));
    if (!Number.isNaN(residual[i])) fact(facts, "rays miss by", figure(residual[i]) + " px");
    cameras.forEach((camera, k) => {
      const base = 2 * (i * cameras.length + k), seen = !Number.isNaN(pixels[base]);
      fact(facts, camera.name, seen ? pixels[base].toFixed(1) + ", " + pixels[base + 1].toFixed(1) : "not seen");
      const line = sights.geometry.attributes.position.array;
      const end = place.subarray(3 * i, 3 * i + 3), from = stands[k];
      line.set(seen && from ? [from.x, from.y, from.z, end[0], end[1], end[2]] : [end[0], end[1], end[2], end[0], end[1], end[2]], 6 * k);
      const piece = page.pieces.get(number(i) + ":" + k);
      if (piece !== undefined) {
        const box = document.createElement("div"), drawing = document.createElement("canvas");
        drawing.setAttribute("role", "img");
        drawing.setAttribute("aria-label", "The point in " + camera.name);
        page.drawPiece(drawing, piece, Number.isNaN(misses[base]) ? null : [misses[base], misses[base + 1]]);
        box.append(drawing, camera.name); crops.append(box);
      }
    });
    sights.geometry.attributes.position.needsUpdate = true;
    ask();
  };
  const choose = (i) => { selected = i; show(i); };
  const step = (by) => {
    const rank = selected < 0 ? (by > 0 ? -1 : 0) : order.indexOf(selected);
    choose(order[(rank + by + count) % count]);
  };
  const nearest = (event) => {
    const box = canvas.getBoundingClientRect();
    const [x, y] = [((event.clientX - box.left) / box.width) * 2 - 1, 1 - ((event.clientY - box.top) / box.height) * 2];
    const m = new THREE.Matrix4().multiplyMatrices(eye.projectionMatrix, eye.matrixWorldInverse).elements, k = located.visible ? uniforms.exaggeration.value : 0;
    let best = -1, least = 144;
    for (let i = 0; i < count; i++) {
      const [a, b, c] = [place[3 * i] + shift[3 * i] * k, place[3 * i + 1] + shift[3 * i + 1] * k, place[3 * i + 2] + shift[3 * i + 2] * k];
      const w = m[3] * a + m[7] * b + m[11] * c + m[15];
      if (w <= 0) continue;
      const dx = (((m[0] * a + m[4] * b + m[8] * c + m[12]) / w - x) * box.width) / 2, dy = (((m[1] * a + m[5] * b + m[9] * c + m[13]) / w - y) * box.height) / 2;
      const d = dx * dx + dy * dy;
      if (d < least) { least = d; best = i; }
    }
    return best;
  };
  let pressed = null;
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons) return;
    const i = nearest(event);
    canvas.style.cursor = i < 0 ? "grab" : "pointer";
    if (i !== hovered) { hovered = i; show(i < 0 ? selected : i); }
  });
  canvas.addEventListener("pointerleave", () => { if (hovered >= 0) { hovered = -1; show(selected); } });
  canvas.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; orbit.enableZoom = true; hint(); });
  canvas.addEventListener("pointerup", (event) => {
    if (pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 5) choose(nearest(event));
    pressed = null;
  });
  canvas.addEventListener("blur", () => { orbit.enableZoom = false; hint(); });
  canvas.addEventListener("focus", () => { orbit.enableZoom = true; hint(); });
  const hint = () => { element("hint").textContent = orbit.enableZoom ? "drag to turn, wheel to zoom, N for the largest error" : "click, then drag and zoom"; };
  const spherical = (yaw, pitch, zoom) => {
    const offset = eye.position.clone().sub(orbit.target);
    const radius = offset.length() * zoom;
    const angle = Math.atan2(offset.x, offset.z) + yaw, height = Math.min(1.54, Math.max(-1.54, Math.asin(offset.y / offset.length()) + pitch));
    eye.position.set(Math.sin(angle) * Math.cos(height), Math.sin(height), Math.cos(angle) * Math.cos(height)).multiplyScalar(radius).add(orbit.target);
    orbit.update(); ask();
  };
  const pan = (x, y) => {
    const step = eye.position.distanceTo(orbit.target) * 0.05;
    const by = new THREE.Vector3(x * step, y * step, 0).applyQuaternion(eye.quaternion);
    eye.position.add(by); orbit.target.add(by); orbit.update(); ask();
  };
  canvas.addEventListener("keydown", (event) => {
    const turnOrPan = (x, y) => (event.shiftKey ? pan(x, y) : spherical(-0.09 * x, 0.09 * y, 1));
    const keys = {
      ArrowLeft: () => turnOrPan(-1, 0), ArrowRight: () => turnOrPan(1, 0), ArrowUp: () => turnOrPan(0, 1), ArrowDown: () => turnOrPan(0, -1),
      "+": () => spherical(0, 0, 0.88), "=": () => spherical(0, 0, 0.88), "-": () => spherical(0, 0, 1.14),
      n: () => step(1), N: () => step(1), p: () => step(-1), P: () => step(-1), Home: () => look(false), r: () => look(true), R: () => look(true), Escape: () => choose(-1),
    };
    if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });

  // Controls.
  const toggle = (id, apply) => { const box = element(id); box.addEventListener("change", () => { apply(box.checked); ask(); }); apply(box.checked); };
  element("show-ellipsoids").checked = held > 0 && count <= 250;
  toggle("show-known", (on) => { wanted.known = on; });
  toggle("show-located", (on) => { wanted.located = located.visible = on; });
  toggle("show-errors", (on) => { wanted.errors = on; });
  element("single").hidden = alone.length === 0;
  element("single-name").textContent = "seen by one camera (" + alone.length + ")";
  toggle("show-single", (on) => { wanted.single = on; });
  toggle("show-axes", (on) => { tripod.visible = on; });
  toggle("show-cameras", (on) => { pyramids.visible = on; labels.forEach((label) => { label.hidden = !on; }); });
  const slider = element("exaggeration");
  const exaggerate = () => {
    const value = Number((10 ** Number(slider.value)).toPrecision(2));
    uniforms.exaggeration.value = value;
    element("factor").textContent = "× " + (value < 10 ? value : Math.round(value));
    placeEllipsoids(); ask();
  };
  slider.value = String(Math.log10(Math.max(1, scene3.exaggeration)));
  slider.addEventListener("input", exaggerate);
  element("colour").addEventListener("change", paint);
  element("home").addEventListener("click", () => look(false));
  element("rig").addEventListener("click", () => look(true));
  element("next").addEventListener("click", () => step(1));
  element("previous").addEventListener("click", () => step(-1));
  exaggerate(); paint(); dress(); hint();
  toggle("show-ellipsoids", (on) => { if (on && !ellipsoids && held) makeEllipsoids(); wanted.ellipsoids = on && held > 0; });
  element("show-ellipsoids").disabled = held === 0;
  element("note").textContent = scene3.note + (count > MOST_MOVING ? " While the view turns, " + MOST_MOVING + " points stand for all." : "");

  const index = (originalNumber) => (compact ? compact.get(originalNumber) ?? -1 : originalNumber);
  page.connect((p) => (index(p) < 0 ? "" : words(index(p))), (p, far) => {
    if (index(p) < 0) return;
    choose(index(p));
    if (far) element("scene").scrollIntoView();
  });
})();
