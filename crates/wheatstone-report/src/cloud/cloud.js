// The 3-D view of a cloud of points: colours, what is hidden, points that are selected, and distances.
"use strict";
(() => {
  const { data, element, figure } = page;
  const { attribute, fact } = space;
  if (!data.cloud || !space.possible()) { space.done("static"); return; }

  // Columns back to numbers; NaN where nothing is known.
  const { count, all, even, centre, basis, extent, ...columns } = data.cloud;
  const cameras = data.cameras, unit = " " + data.unit;
  const upper = (text) => {
    const bytes = new Uint8Array(page.bytes(text)), out = new Uint32Array(bytes.length / 3);
    for (let i = 0; i < out.length; i++) out[i] = (bytes[3 * i] << 8) | (bytes[3 * i + 1] << 16) | (bytes[3 * i + 2] << 24);
    return new Float32Array(out.buffer);
  };
  const linear = ({ low, high, values }) => Float32Array.from(new Uint16Array(page.bytes(values)), (code) => (code === 65535 ? NaN : low + (code / 65534) * (high - low)));
  const logarithmic = ({ low, high, values }) => {
    const codes = new Uint32Array(page.bytes(values)), out = new Float32Array(3 * codes.length);
    const ratio = Math.log(high / low) / 1021;
    const sigma = (code) => (code === 1023 ? NaN : code === 1022 ? 0 : low * Math.exp(code * ratio));
    for (let i = 0; i < codes.length; i++) for (let k = 0; k < 3; k++) out[3 * i + k] = sigma((codes[i] >>> (10 * k)) & 1023);
    return out;
  };
  const world = upper(columns.places);
  const colours = columns.colours ? new Uint8Array(page.bytes(columns.colours)) : null;
  const sigmas = columns.sigmas ? logarithmic(columns.sigmas) : null;
  const confidence = columns.confidence ? linear(columns.confidence) : null;
  const pixels = columns.pixels.map((axes) => axes.map(linear));
  const position = (i, k) => world[3 * i + k] + centre[k];
  const total = sigmas && Float32Array.from({ length: count }, (_, i) => Math.hypot(sigmas[3 * i], sigmas[3 * i + 1], sigmas[3 * i + 2]));

  // Depth along the direction in which the cameras together look, from the middle of them.
  const stands = cameras.map((camera) => camera.centre).filter(Boolean);
  const origin = [0, 1, 2].map((k) => stands.reduce((sum, stand) => sum + stand[k], 0) / Math.max(1, stands.length));
  const depth = Float32Array.from({ length: count }, (_, i) => basis[2].reduce((sum, v, k) => sum + v * (position(i, k) - origin[k]), 0));

  const view = space.open(data.cloud, world, count, {
    side: [0.35, 0.22, 0.91], farther: 4 / 3, antialias: false, hint: "drag to turn, wheel to zoom, click on a point",
  });
  const { place, stage, ask } = view;

  // Points beyond the limit are put out of sight on the graphics side.
  const tint = new Uint8Array(4 * count).fill(255);
  const tints = attribute(tint, 4, true);
  const spread = total ? total.map((value) => (Number.isNaN(value) ? 3e38 : value)) : new Float32Array(count);
  const uniforms = { size: { value: 3 }, limit: { value: 3.4e38 } };
  const cloud = new THREE.Points(new THREE.BufferGeometry(), new THREE.ShaderMaterial({
    uniforms,
    vertexShader: `attribute vec3 tint; attribute float spread; uniform float size; uniform float limit; varying vec3 colour;
      void main() { colour = tint; gl_PointSize = size;
        gl_Position = spread > limit ? vec4(2.0, 2.0, 2.0, 1.0) : projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`,
    fragmentShader: `uniform float size; varying vec3 colour;
      void main() { vec2 p = gl_PointCoord - 0.5; if (size > 3.0 && dot(p, p) > 0.25) discard; gl_FragColor = vec4(colour, 1.0); }`,
  }));
  cloud.geometry.setAttribute("position", attribute(place, 3));
  cloud.geometry.setAttribute("tint", tints);
  cloud.geometry.setAttribute("spread", attribute(spread, 1));
  cloud.geometry.setIndex(attribute(space.shuffled(count), 1));
  cloud.frustumCulled = false;
  view.scene.add(cloud);
  const span = view.lines(new Array(6).fill(0), 0xd55e00);
  span.material.depthTest = false;
  span.renderOrder = 1;
  span.visible = false;

  // Colours: a bar from the second to the 98th of 100 points.
  const ranges = new Map();
  const range = (values) => {
    if (!ranges.has(values)) {
      const sorted = values.filter(Number.isFinite).sort();
      const at = (share) => sorted[Math.round(share * (sorted.length - 1))];
      ranges.set(values, sorted.length ? [at(0.02), at(0.98)] : [0, 1]);
    }
    return ranges.get(values);
  };
  const scales = {
    depth: [depth, "depth", unit], sigma: [total, "standard deviation", unit], confidence: [confidence, "confidence", ""],
  };
  const paint = () => {
    const mode = element("colour").value;
    element("scale").hidden = mode === "picture";
    if (mode === "picture") {
      for (let i = 0; i < count; i++) for (let k = 0; k < 3; k++) tint[4 * i + k] = colours[3 * i + k];
    } else {
      const [values, name, of] = scales[mode];
      const [low, high] = range(values);
      for (let i = 0; i < count; i++) {
        // What is not known is grey.
        const c = Number.isFinite(values[i]) ? space.ramp((values[i] - low) / (high - low || 1)) : { r: 0.5, g: 0.5, b: 0.5 };
        tint[4 * i] = 255 * c.r; tint[4 * i + 1] = 255 * c.g; tint[4 * i + 2] = 255 * c.b;
      }
      element("scale-low").textContent = name + " " + figure(low) + of;
      element("scale-high").textContent = figure(high) + of;
    }
    tints.needsUpdate = true;
    ask();
  };

  // Until the view rests, some points stand for all, each somewhat larger.
  const MOST_MOVING = 80000;
  const dot = () => Number(element("size").value);
  let limit = Infinity;
  const hidden = (i) => limit < Infinity && spread[i] > limit;

  // Points that are selected: one, or two to measure between.
  let picked = [];
  const measuring = element("measure");
  const marks = ["A", "B"].map((name) => {
    const mark = view.named(name, "mark");
    mark.setAttribute("aria-hidden", "true");
    mark.hidden = true;
    return mark;
  });
  const cross = view.named("", "cross");
  cross.setAttribute("aria-hidden", "true");
  view.onDraw((moving) => {
    const few = moving && count > MOST_MOVING;
    cloud.geometry.setDrawRange(0, few ? MOST_MOVING : count);
    uniforms.size.value = dot() * Math.min(devicePixelRatio, 2) * (few ? Math.min(2, Math.sqrt(count / MOST_MOVING)) : 1);
  }, () => marks.forEach((mark, n) => {
    const spot = n < picked.length && view.onStage(new THREE.Vector3(...place.subarray(3 * picked[n], 3 * picked[n] + 3)));
    mark.hidden = !spot;
    if (spot) mark.style.transform = `translate(${spot[0]}px, ${spot[1]}px)`;
  }));

  // A number to the digit that its standard deviation, of two digits, ends with; else to a millionth of the scene.
  const places = (sigma) => Math.min(12, Math.max(0, (sigma > 0 ? 1 : 0) - Math.floor(Math.log10(sigma > 0 ? sigma : extent * 1e-5))));
  const withSigma = (value, sigma) => {
    const digits = places(sigma);
    return value.toFixed(digits) + (Number.isFinite(sigma) ? " ± " + sigma.toFixed(digits) : "") + unit;
  };
  // The distance between two points and its standard deviation: those of the points, which are independent, along the line.
  const distance = (a, b) => {
    const between = [0, 1, 2].map((k) => world[3 * b + k] - world[3 * a + k]);
    const length = Math.hypot(...between);
    if (!sigmas) return [length, NaN];
    // Two at one place have no line between them: any direction stands for it.
    const along = length > 0 ? between.map((v) => v / length) : [1, 0, 0];
    return [length, Math.sqrt(along.reduce((sum, v, k) => sum + v * v * (sigmas[3 * a + k] ** 2 + sigmas[3 * b + k] ** 2), 0))];
  };
  const title = (i) => (even ? "Point " + (Math.floor((i * all) / count) + 1) : "Point");
  const show = () => {
    const facts = element("facts"), i = picked.length ? picked[picked.length - 1] : -1;
    facts.replaceChildren();
    element("point-hint").hidden = i >= 0 && !(measuring.checked && picked.length === 1);
    element("point-hint").textContent = i < 0
      ? "Click on a point, or move it to the middle and press Enter." : "Select a second point to measure the distance.";
    marks.forEach((mark) => mark.classList.toggle("bare", !measuring.checked));
    view.sight(i, (k) => pixels[k] !== undefined && Number.isFinite(pixels[k][0][i]));
    const both = picked.length === 2;
    span.visible = both;
    element("distance-part").hidden = !both;
    const name = measuring.checked && i >= 0 ? " (" + "AB"[picked.length - 1] + ")" : "";
    element("point-title").textContent = i < 0 ? "No point selected" : title(i) + name;
    if (i >= 0) {
      ["X", "Y", "Z"].forEach((axis, k) => fact(facts, axis, withSigma(position(i, k), sigmas ? sigmas[3 * i + k] : NaN)));
      fact(facts, "depth", figure(depth[i]) + unit);
      if (total) fact(facts, "standard deviation", figure(total[i]) + unit);
      if (confidence) fact(facts, "confidence", figure(confidence[i]));
      pixels.forEach(([x, y], k) => fact(facts, cameras[k].name, Number.isFinite(x[i]) ? x[i].toFixed(1) + ", " + y[i].toFixed(1) + " px" : "not seen"));
    }
    if (both) {
      const [length, sigma] = distance(...picked);
      element("distance").textContent = withSigma(length, sigma);
      element("distance-note").textContent = Number.isFinite(sigma) ? "± is one standard deviation, with the errors of both points taken as independent." : "";
      picked.forEach((point, n) => span.geometry.attributes.position.array.set(place.subarray(3 * point, 3 * point + 3), 3 * n));
      span.geometry.attributes.position.needsUpdate = true;
    }
    ask();
  };
  const choose = (i) => {
    if (i < 0) picked = [];
    else if (measuring.checked && picked.length === 1) picked.push(i);
    else picked = [i];
    show();
  };
  const nearest = (spot, reach) => view.nearest(spot, { radius: dot() / 2 + 1, reach: reach + dot() / 2, skipped: hidden });
  view.onClick((spot, kind) => choose(nearest(spot, kind === "touch" ? 18 : 10)));
  const middle = () => {
    const box = stage.getBoundingClientRect();
    const found = nearest([box.left + box.width / 2, box.top + box.height / 2], 40);
    if (found >= 0) choose(found);
  };
  const clear = () => choose(-1);
  const measure = () => { if (!measuring.checked) picked = picked.slice(-1); show(); };
  view.onKeys({ enter: middle, " ": middle, escape: clear, m: () => { measuring.checked = !measuring.checked; measure(); } });
  element("middle").addEventListener("click", middle);
  element("clear").addEventListener("click", clear);
  measuring.addEventListener("change", measure);

  // The limit moves evenly through the logarithm of the standard deviations.
  const slider = element("limit");
  const known = total ? total.filter((value) => value > 0) : [];
  const ends = known.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, 0]);
  const bound = () => {
    const share = Number(slider.value) / 1000;
    limit = share === 1 || !known.length ? Infinity : ends[0] * (ends[1] / ends[0]) ** share;
    uniforms.limit.value = Math.min(limit, 3.4e38);
    let left = 0;
    for (let i = 0; i < count; i++) if (!hidden(i)) left += 1;
    const words = limit < Infinity ? figure(limit) + unit : "none hidden";
    element("limit-value").textContent = words;
    slider.setAttribute("aria-valuetext", words);
    const said = [];
    if (count < all) said.push(count + " of " + all + " points shown.");
    if (left < count) said.push(count - left + " points are hidden.");
    if (count > MOST_MOVING) said.push("While the view turns, " + MOST_MOVING + " points stand for all.");
    element("note").textContent = said.join(" ");
    if (picked.some(hidden)) clear();
    ask();
  };
  slider.addEventListener("input", bound);
  element("size").addEventListener("input", ask);
  const select = element("colour");
  if (!colours) select.value = "depth";
  for (const option of [...select.options]) if (option.hidden) option.remove();
  select.addEventListener("change", paint);
  view.dress();
  bound(); paint(); show();
})();
