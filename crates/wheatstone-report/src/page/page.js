// The page without its 3-D view: theme, words at the pointer, pieces of pictures.
"use strict";
const page = (() => {
  const body = document.body;
  let errors = 0;
  const fail = () => { body.dataset.errors = String(++errors); };
  window.addEventListener("error", fail);
  window.addEventListener("unhandledrejection", fail);
  document.addEventListener("securitypolicyviolation", fail);

  const data = JSON.parse(document.getElementById("data").textContent);
  const element = (id) => document.getElementById(id);

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const floats = (text) => new Float32Array(bytes(text));

  // Three significant digits, as everywhere else in the page.
  const figure = (value) => {
    if (!Number.isFinite(value)) return "-";
    if (value === 0) return "0";
    const size = Math.floor(Math.log10(Math.abs(value)));
    return size < -4 || size > 5 ? value.toExponential(2) : value.toFixed(Math.max(0, 2 - size));
  };

  // Light or dark: as the system has it until the reader chooses.
  const system = matchMedia("(prefers-color-scheme: dark)");
  const button = element("theme");
  const isDark = () => (document.documentElement.dataset.theme || (system.matches ? "dark" : "light")) === "dark";
  const listeners = [];
  const changed = () => {
    button.textContent = isDark() ? "Light" : "Dark";
    listeners.forEach((listener) => listener());
  };
  button.addEventListener("click", () => {
    document.documentElement.dataset.theme = isDark() ? "light" : "dark";
    changed();
  });
  system.addEventListener("change", changed);
  button.hidden = false;
  button.textContent = isDark() ? "Light" : "Dark";

  // Pieces of pictures about points.
  const loaded = (crops) => {
    if (!crops) return null;
    const sheet = new Image();
    const ready = new Promise((resolve) => { sheet.onload = () => resolve(sheet); sheet.onerror = fail; });
    sheet.src = crops.data;
    return { ready, side: crops.side, columns: crops.columns };
  };
  const ofPoints = loaded(data.crops), ofOutliers = loaded(data.outliers);
  const pieces = new Map();
  if (data.crops) data.crops.of.forEach(([point, camera], number) => pieces.set(point + ":" + camera, number));

  // Draws a piece with a cross where the point was found, and a ring where it was expected.
  const draw = ({ ready, side, columns }, canvas, number, miss) => {
    const scale = Math.max(1, Math.round(136 / side));
    canvas.width = canvas.height = side * scale;
    ready.then((sheet) => {
      const g = canvas.getContext("2d");
      g.imageSmoothingEnabled = false;
      const [x, y] = [(number % columns) * side, Math.floor(number / columns) * side];
      g.drawImage(sheet, x, y, side, side, 0, 0, canvas.width, canvas.height);
      const middle = canvas.width / 2;
      const stroke = (colour, width, path) => {
        g.strokeStyle = colour; g.lineWidth = width; g.beginPath(); path(); g.stroke();
      };
      const cross = () => {
        for (const [a, b] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
          g.moveTo(middle + a * 5, middle + b * 5); g.lineTo(middle + a * 16, middle + b * 16);
        }
      };
      stroke("#000", 4, cross); stroke("#f0e442", 2, cross);
      if (miss) {
        const ring = () => g.arc(middle + miss[0] * scale, middle + miss[1] * scale, 6, 0, 7);
        stroke("#000", 4, ring); stroke("#56b4e9", 2, ring);
      }
    });
  };
  const drawPiece = (canvas, number, miss) => draw(ofPoints, canvas, number, miss);
  for (const canvas of document.querySelectorAll("canvas[data-outlier]")) draw(ofOutliers, canvas, Number(canvas.dataset.outlier), null);

  // Words at the pointer, for marks that stand for points.
  const tip = element("tip");
  let describe = () => "";
  let select = () => {};
  const over = (event) => {
    const mark = event.target.closest && event.target.closest("[data-p]");
    if (!mark) { tip.hidden = true; return; }
    tip.textContent = describe(Number(mark.dataset.p));
    tip.hidden = tip.textContent === "";
    const left = Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 8);
    tip.style.left = Math.max(4, left) + "px";
    tip.style.top = Math.min(event.clientY + 14, innerHeight - tip.offsetHeight - 8) + "px";
  };
  document.addEventListener("pointerover", over);
  document.addEventListener("click", (event) => {
    const mark = event.target.closest && event.target.closest("[data-p]");
    if (mark) select(Number(mark.dataset.p), mark.tagName === "BUTTON");
  });

  return {
    data, element, floats, bytes, figure, pieces, drawPiece, fail,
    onTheme: (listener) => listeners.push(listener),
    connect: (words, choose) => { describe = words; select = choose; },
  };
})();
