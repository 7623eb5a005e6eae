// What every 3-D view has: stage, eye, cameras, axes, colours and keys. Places are shown in the cameras'
// common frame: right, up, and towards the reader.
"use strict";
const space = (() => {
  const { data, element, figure } = page;
  const body = document.body;
  const done = (state) => { body.dataset.ready = state; };
  const possible = () => {
    const probe = document.createElement("canvas").getContext("webgl2");
    const lose = probe && probe.getExtension("WEBGL_lose_context");
    if (lose) lose.loseContext();
    return Boolean(probe);
  };

  // Cividis in ten steps, and a colour of it by its share; colours are those of the screen.
  const screen = (hex) => new THREE.Color(hex).convertLinearToSRGB();
  const cividis = [0x00224e, 0x123570, 0x3b496c, 0x575d6d, 0x707173, 0x8a8678, 0xa59c74, 0xc3b369, 0xe1cc55, 0xfee838].map(screen);
  const mixed = new THREE.Color();
  const ramp = (share) => {
    const at = Math.min(1, Math.max(0, share || 0)) * (cividis.length - 1), low = Math.min(cividis.length - 2, Math.floor(at));
    return mixed.copy(cividis[low]).lerp(cividis[low + 1], at - low);
  };

  // In random order, so that the first ones stand for all while the view turns.
  const shuffled = (count) => {
    const order = Uint32Array.from({ length: count }, (_, i) => i);
    for (let i = count - 1, seed = 1; i > 0; i--) {
      seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
      const j = seed % (i + 1);
      [order[i], order[j]] = [order[j], order[i]];
    }
    return order;
  };
  const attribute = (array, of, normalized = false) => new THREE.BufferAttribute(array, of, normalized);
  const fact = (list, name, value) => {
    const dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = name; dd.textContent = value; list.append(dt, dd);
  };

  // Opens the view of `count` places, `world` from the frame's centre, three numbers each. Of `how`, `side` is the
  // direction from which the eye looks at first, `farther` how many times as far away it may stand to have the cameras on the
  // stage too, `antialias` whether edges are smoothed, `hint` what to do once the view is active.
  const open = (frame, world, count, how) => {
    const cameras = data.cameras;
    const [right, up, forward] = frame.basis;
    const dot = (a, x, y, z) => a[0] * x + a[1] * y + a[2] * z;
    // To the frame of the view, where the scene has about the size of 1.
    const size = frame.extent || 1;
    const turn = (x, y, z) => [dot(right, x, y, z) / size, dot(up, x, y, z) / size, -dot(forward, x, y, z) / size];
    const place = new Float32Array(3 * count);
    for (let i = 0; i < count; i++) place.set(turn(world[3 * i], world[3 * i + 1], world[3 * i + 2]), 3 * i);

    const canvas = element("canvas"), stage = element("stage");
    for (const part of document.querySelectorAll("#scene .live")) part.hidden = false;
    for (const part of document.querySelectorAll("#scene .still")) part.hidden = true;
    const renderer = new THREE.WebGLRenderer({ canvas, antialias: how.antialias, alpha: true });
    const scene = new THREE.Scene();
    const eye = new THREE.PerspectiveCamera(40, 1, 0.001, 100);
    const orbit = new THREE.OrbitControls(eye, canvas);
    orbit.enableDamping = false;
    orbit.enableZoom = false;
    canvas.style.touchAction = "pan-y";

    const view = { place, size, turn, canvas, stage, scene, eye, moving: false };
    let rest = 0, asked = false;
    const ask = () => { if (!asked) { asked = true; requestAnimationFrame(draw); } };
    const stir = () => {
      view.moving = true;
      clearTimeout(rest);
      rest = setTimeout(() => { view.moving = false; ask(); }, 160);
      ask();
    };

    // Cameras as pyramids.
    const inCentre = (p) => turn(p[0] - frame.centre[0], p[1] - frame.centre[1], p[2] - frame.centre[2]);
    const frusta = [], stands = [], outlines = [];
    for (const camera of cameras) {
      if (!camera.centre) { stands.push(null); continue; }
      const from = inCentre(camera.centre);
      stands.push(new THREE.Vector3(...from));
      const reach = 0.16;
      const ends = camera.corners.map((c) => turn(c[0] * size * reach, c[1] * size * reach, c[2] * size * reach).map((v, k) => v + from[k]));
      outlines.push(...[from, ...ends].map((p) => new THREE.Vector3(...p)));
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
    // Lines from the cameras in which a point is seen to where it is known to be; none for -1.
    const sight = (i, seen) => {
      sights.visible = i >= 0;
      if (i < 0) return;
      const line = sights.geometry.attributes.position.array;
      const end = place.subarray(3 * i, 3 * i + 3);
      stands.forEach((from, k) => line.set(seen(k) && from ? [from.x, from.y, from.z, ...end] : [...end, ...end], 6 * k));
      sights.geometry.attributes.position.needsUpdate = true;
    };

    // The axes of the world, and a bar as long as each.
    const axes = frame.axes, tips = [], axisLines = [];
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

    // Lines in the colour of the words; `more` dresses what a view adds.
    const dress = (more) => {
      const ink = getComputedStyle(body).getPropertyValue("color");
      const muted = getComputedStyle(document.documentElement).getPropertyValue("--muted").trim();
      pyramids.material.color.set(ink);
      tripod.material.color.set(ink);
      if (more) more(ink, muted);
      ask();
    };
    view.dress = (more) => { page.onTheme(() => dress(more)); dress(more); };

    // Where the eye goes: as near as all of it fits. Places far beyond the extent do not count.
    const from = new THREE.Vector3(...how.side).normalize();
    const across = new THREE.Vector3(0, 1, 0).cross(from).normalize(), above = from.clone().cross(across);
    const some = [];
    for (let i = 0; i < count; i += Math.ceil(count / 5000)) {
      const p = new THREE.Vector3(...place.subarray(3 * i, 3 * i + 3));
      if (p.length() < 1.001) some.push(p);
    }
    some.push(...tips);
    // Where the eye stands, and what it looks at, to have all these places on the stage.
    const framing = (places) => {
      const target = new THREE.Vector3();
      for (const axis of places.length ? [across, above, from] : []) {
        const along = places.map((p) => p.dot(axis));
        target.addScaledVector(axis, (Math.min(...along) + Math.max(...along)) / 2);
      }
      const slope = Math.tan((eye.fov * Math.PI) / 360) * 0.86;
      let distance = 0.2;
      for (const p of places) {
        const v = p.clone().sub(target);
        distance = Math.max(distance, v.dot(from) + Math.max(Math.abs(v.dot(across)) / eye.aspect, Math.abs(v.dot(above))) / slope);
      }
      return { target, distance };
    };
    const look = (whole) => {
      const { target, distance } = framing(whole ? some.concat(outlines) : some);
      orbit.target.copy(target);
      eye.position.copy(target).addScaledVector(from, distance);
      orbit.update(); ask();
    };
    // At first the cameras are looked at too, unless the places would then become too small.
    const lookAtFirst = () => look(framing(some.concat(outlines)).distance < how.farther * framing(some).distance);

    let frames = 0, sized = false, before = () => {}, after = () => {};
    const at = new THREE.Vector3();
    // Where a place lies on the stage, in pixels of the page; nothing behind the eye.
    const onStage = (p) => {
      at.copy(p).project(eye);
      return at.z > 1 ? null : [((at.x + 1) / 2) * stage.clientWidth, ((1 - at.y) / 2) * stage.clientHeight];
    };
    const placeLabels = () => {
      const taken = [];
      labels.forEach((label, k) => {
        const spot = stands[k] && onStage(stands[k]);
        label.hidden = !pyramids.visible || !spot;
        if (label.hidden) return;
        const x = spot[0] + 8, wide = label.textContent.length * 8 + 16;
        // Above the lower border and the scale, where its place is.
        const lowest = stage.clientHeight - 56, isLow = spot[1] < stage.clientHeight && spot[1] > lowest - 26;
        let y = isLow ? Math.min(spot[1] + 6, lowest) : spot[1] + 6;
        // Names that would hide each other stand one below the other, at the lower border one above the other.
        while (taken.some((other) => Math.abs(other.y - y) < 22 && x < other.x + other.wide && other.x < x + wide)) y += isLow ? -23 : 23;
        taken.push({ x, y, wide });
        label.style.transform = `translate(${x}px, ${y}px)`;
      });
      axisNames.forEach((label, k) => {
        const spot = onStage(tips[k]);
        label.hidden = !tripod.visible || !spot;
        if (spot) label.style.transform = `translate(${spot[0] - 5}px, ${spot[1] - 10}px)`;
      });
    };
    function draw() {
      asked = false;
      if (!sized) return;
      before(view.moving);
      renderer.render(scene, eye);
      frames += 1;
      body.dataset.frames = String(frames);
      placeLabels();
      after();
      const high = 2 * eye.position.distanceTo(orbit.target) * Math.tan((eye.fov * Math.PI) / 360);
      element("length").hidden = !axes || !tripod.visible;
      if (axes) element("length").firstChild.style.width = `${(axes.length / size / high) * stage.clientHeight}px`;
      if (frames > 1) return;
      const gl = renderer.getContext(), [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight], out = new Uint8Array(4 * w * h);
      gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, out);
      let painted = 0;
      for (let k = 3; k < out.length; k += 4) if (out[k] > 0) painted += 1;
      body.dataset.painted = String(painted);
      done("3d");
    }
    const fit = () => {
      const [w, h] = [stage.clientWidth, stage.clientHeight];
      if (!w || !h) return;
      renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      renderer.setSize(w, h, false);
      eye.aspect = w / h; eye.updateProjectionMatrix();
      if (!sized) { sized = true; lookAtFirst(); }
      draw();
    };
    new ResizeObserver(fit).observe(stage);
    orbit.addEventListener("change", stir);

    // The point at a place of the page: the front-most of those whose dots, of `radius` pixels, cover it, or else the
    // nearest within `reach` pixels; -1 where there is none. `put` writes where a point is drawn, `skipped` says which are not.
    view.nearest = ([left, top], { radius = 0, reach = 12, put, skipped }) => {
      eye.updateMatrixWorld();
      const box = canvas.getBoundingClientRect();
      const [x, y] = [((left - box.left) / box.width) * 2 - 1, 1 - ((top - box.top) / box.height) * 2];
      const m = new THREE.Matrix4().multiplyMatrices(eye.projectionMatrix, eye.matrixWorldInverse).elements;
      let best = -1, least = reach * reach, front = Infinity;
      const p = [0, 0, 0];
      for (let i = 0; i < count; i++) {
        if (skipped && skipped(i)) continue;
        if (put) put(p, i); else { p[0] = place[3 * i]; p[1] = place[3 * i + 1]; p[2] = place[3 * i + 2]; }
        const [a, b, c] = p;
        const w = m[3] * a + m[7] * b + m[11] * c + m[15];
        if (!(w > 0)) continue;
        const dx = (((m[0] * a + m[4] * b + m[8] * c + m[12]) / w - x) * box.width) / 2, dy = (((m[1] * a + m[5] * b + m[9] * c + m[13]) / w - y) * box.height) / 2;
        // Within a dot all are as near as each other, and so the front-most counts.
        const d = Math.max(dx * dx + dy * dy, radius * radius);
        if (d < least || (d === least && w < front)) { least = d; best = i; front = w; }
      }
      return best;
    };
    // A click, as against a turn: `choose` is given the place on the page and the kind of pointer.
    view.onClick = (choose) => {
      let pressed = null;
      canvas.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; activate(true); });
      canvas.addEventListener("pointerup", (event) => {
        if (pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 5) choose([event.clientX, event.clientY], event.pointerType);
        pressed = null;
      });
    };
    // Until it is active, the wheel and fingers go on scrolling the page.
    const activate = (on) => {
      orbit.enableZoom = on;
      canvas.style.touchAction = on ? "none" : "pan-y";
      element("hint").textContent = on ? how.hint : "click, then drag and zoom";
    };
    canvas.addEventListener("blur", () => activate(false));
    canvas.addEventListener("focus", () => activate(true));
    activate(false);
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
    // Keys of every view, and `more` of one.
    view.onKeys = (more) => canvas.addEventListener("keydown", (event) => {
      const turnOrPan = (x, y) => (event.shiftKey ? pan(x, y) : spherical(-0.09 * x, 0.09 * y, 1));
      const keys = {
        ArrowLeft: () => turnOrPan(-1, 0), ArrowRight: () => turnOrPan(1, 0), ArrowUp: () => turnOrPan(0, 1), ArrowDown: () => turnOrPan(0, -1),
        "+": () => spherical(0, 0, 0.88), "=": () => spherical(0, 0, 0.88), "-": () => spherical(0, 0, 1.14), home: () => look(false), r: () => look(true), ...more,
      };
      const act = keys[event.key] || keys[event.key.toLowerCase()];
      if (event.ctrlKey || event.metaKey || event.altKey || !act) return;
      event.preventDefault();
      act();
    });
    view.toggle = (id, apply) => { const box = element(id); box.addEventListener("change", () => { apply(box.checked); ask(); }); apply(box.checked); };
    view.toggle("show-axes", (on) => { tripod.visible = on; });
    view.toggle("show-cameras", (on) => { pyramids.visible = on; });
    element("home").addEventListener("click", () => look(false));
    element("rig").addEventListener("click", () => look(true));
    return Object.assign(view, {
      ask, lines, named, sight, onStage, look,
      onDraw: (first, then = after) => { before = first; after = then; },
    });
  };
  return { possible, done, open, ramp, screen, shuffled, attribute, fact };
})();
