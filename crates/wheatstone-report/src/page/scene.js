// The 3-D view of a report: points, their errors and ellipsoids.
"use strict";
(() => {
  const { data, element, figure } = page;
  const { attribute, fact } = space;
  if (!data.scene || !space.possible()) { space.done("static"); return; }

  const scene3 = data.scene;
  const count = scene3.count;
  const world = page.floats(scene3.world), error = page.floats(scene3.error);
  const pixels = page.floats(scene3.pixels), misses = page.floats(scene3.misses);
  const promised = page.floats(scene3.promised), residual = page.floats(scene3.residual);
  const covariance = scene3.covariance ? page.floats(scene3.covariance) : null;
  const views = new Uint16Array(page.bytes(scene3.view));
  const original = scene3.original ? new Uint32Array(page.bytes(scene3.original)) : null;
  const number = (index) => (original ? original[index] : index);
  const compact = original ? new Map(Array.from(original, (value, index) => [value, index])) : null;
  const cameras = data.cameras;
  const MOST_MOVING = 6000;
  const view = space.open(scene3, world, count, {
    side: [0.78, 0.5, 0.62], farther: 3.5, antialias: count < 2000, hint: "drag to turn, wheel to zoom, N for the largest error",
  });
  const { place, size, turn, scene, canvas, ask } = view;
  const [right, up, forward] = scene3.basis;
  const shift = new Float32Array(3 * count), length = new Float32Array(count);
  for (let i = 0; i < count; i++) {
    const e = [error[3 * i], error[3 * i + 1], error[3 * i + 2]];
    length[i] = Math.hypot(...e);
    shift.set(Number.isNaN(e[0]) ? [0, 0, 0] : turn(...e), 3 * i);
  }
  // Points of one camera alone have a known place only: they are drawn as rings.
  const seenBy = (i) => cameras.reduce((sum, _, k) => sum + (Number.isNaN(pixels[2 * (i * cameras.length + k)]) ? 0 : 1), 0);
  const single = Array.from({ length: count }, (_, i) => cameras.length > 1 && seenBy(i) === 1);
  const order = Array.from({ length: count }, (_, i) => i);
  order.sort((a, b) => (Number.isNaN(length[a]) ? -1 : length[b]) - (Number.isNaN(length[b]) ? -1 : length[a]) || a - b);

  scene.add(new THREE.AmbientLight(0xffffff, 2));
  const sun = new THREE.DirectionalLight(0xffffff, 2);
  sun.position.set(1, 2, 3);
  scene.add(sun);

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
  const geometry = (along, index) => {
    const g = new THREE.BufferGeometry();
    g.setAttribute("position", attribute(place, 3));
    g.setAttribute("shift", attribute(shift, 3));
    g.setAttribute("tint", tints);
    g.setAttribute("along", attribute(new Float32Array(count).fill(along), 1));
    g.setIndex(attribute(index, 1));
    return g;
  };
  const shuffled = space.shuffled(count);
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
  const okabe = [0x0072b2, 0xd55e00, 0x009e73, 0xcc79a7, 0xe69f00, 0x56b4e9].map(space.screen);
  const sorted = Array.from(length).filter(Number.isFinite).sort((a, b) => a - b);
  const most = sorted.length ? sorted[Math.floor(0.98 * (sorted.length - 1))] || 1 : 1;
  const colourOf = (i, mode) => {
    if (mode === "view") return okabe[views[i] % okabe.length];
    return space.ramp(mode === "ratio" ? length[i] / promised[i] / 3 : length[i] / most);
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
    element("scale-high").textContent = mode === "ratio" ? "3 × the predicted error" : figure(most) + " " + data.unit;
    ask();
  };
  view.dress((ink, muted) => {
    uniforms.rim.value.set(ink).convertLinearToSRGB();
    uniforms.flat.value.set(muted).convertLinearToSRGB();
  });

  const wanted = { known: true, located: true, single: true, errors: true, ellipsoids: false };
  view.onDraw((moving) => {
    const few = moving && count > MOST_MOVING;
    located.geometry.setDrawRange(0, few ? MOST_MOVING : count);
    singles.visible = wanted.single;
    known.geometry.setDrawRange(0, few ? MOST_MOVING : count);
    known.visible = wanted.known && !(few && wanted.located);
    errors.visible = wanted.errors && !few;
    if (ellipsoids) ellipsoids.visible = wanted.ellipsoids && !(moving && held > 250);
    located.material.uniforms.size.value = (dense ? 4 : wanted.ellipsoids ? 4 : 8) * devicePixelRatio;
  });

  // Choosing points.
  let hovered = -1, selected = -1;
  const title = (i) => {
    const name = data.views[views[i]], id = scene3.ids ? scene3.ids[i] : null;
    return "Point " + (id === null || id === undefined ? number(i) + 1 : id) + (name === undefined ? "" : ", view " + name);
  };
  const words = (i) => title(i) + (Number.isNaN(length[i]) ? "" : ": " + figure(length[i]) + " " + data.unit);
  const show = (i) => {
    const facts = element("facts"), crops = element("crops"), unit = " " + data.unit;
    facts.replaceChildren(); crops.replaceChildren();
    element("point-title").textContent = i < 0 ? "No point selected" : title(i);
    element("point-hint").hidden = i >= 0;
    element("next").textContent = selected < 0 ? "Largest error" : "Next smaller";
    view.sight(i, (k) => !Number.isNaN(pixels[2 * (i * cameras.length + k)]));
    if (i < 0) { ask(); return; }
    fact(facts, "error", figure(length[i]) + unit);
    fact(facts, "predicted", figure(promised[i]) + unit);
    ["X", "Y", "Z"].forEach((axis, k) => fact(facts, "along " + axis, figure(error[3 * i + k]) + unit));
    ["X", "Y", "Z"].forEach((axis, k) => fact(facts, axis, figure(world[3 * i + k] + scene3.centre[k]) + unit));
    if (!Number.isNaN(residual[i])) fact(facts, "rays miss by", figure(residual[i]) + " px");
    cameras.forEach((camera, k) => {
      const base = 2 * (i * cameras.length + k), seen = !Number.isNaN(pixels[base]);
      fact(facts, camera.name, seen ? pixels[base].toFixed(1) + ", " + pixels[base + 1].toFixed(1) : "not seen");
      const piece = page.pieces.get(number(i) + ":" + k);
      if (piece !== undefined) {
        const box = document.createElement("div"), drawing = document.createElement("canvas");
        drawing.setAttribute("role", "img");
        drawing.setAttribute("aria-label", "The point in " + camera.name);
        page.drawPiece(drawing, piece, Number.isNaN(misses[base]) ? null : [misses[base], misses[base + 1]]);
        box.append(drawing, camera.name); crops.append(box);
      }
    });
    ask();
  };
  const choose = (i) => { selected = i; show(i); };
  const step = (by) => {
    const rank = selected < 0 ? (by > 0 ? -1 : 0) : order.indexOf(selected);
    choose(order[(rank + by + count) % count]);
  };
  // Where points are drawn: at their known place, moved by their error where that is drawn.
  const put = (p, i) => { for (let k = 0; k < 3; k++) p[k] = place[3 * i + k] + (located.visible ? shift[3 * i + k] * uniforms.exaggeration.value : 0); };
  const nearest = (spot) => view.nearest(spot, { radius: dense ? 2 : 4, put });
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons) return;
    const i = nearest([event.clientX, event.clientY]);
    canvas.style.cursor = i < 0 ? "grab" : "pointer";
    if (i !== hovered) { hovered = i; show(i < 0 ? selected : i); }
  });
  canvas.addEventListener("pointerleave", () => { if (hovered >= 0) { hovered = -1; show(selected); } });
  view.onClick((spot) => choose(nearest(spot)));
  view.onKeys({ n: () => step(1), p: () => step(-1), escape: () => choose(-1) });

  // Controls.
  const { toggle } = view;
  element("show-ellipsoids").checked = held > 0 && count <= 250;
  toggle("show-known", (on) => { wanted.known = on; });
  toggle("show-located", (on) => { wanted.located = located.visible = on; });
  toggle("show-errors", (on) => { wanted.errors = on; });
  element("single").hidden = alone.length === 0;
  element("single-name").textContent = "seen by one camera (" + alone.length + ")";
  toggle("show-single", (on) => { wanted.single = on; });
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
  element("next").addEventListener("click", () => step(1));
  element("previous").addEventListener("click", () => step(-1));
  exaggerate(); paint();
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
