// The slider, and all that follows it.

const facts = JSON.parse(document.getElementById('data').textContent);
const $ = (name) => document.getElementById(name);
const root = document.documentElement;
root.classList.add('script');

const times = numbers(facts.time, Float64Array);
const compared = numbers(facts.compared, Float64Array);
const frames = times.length;
const quantities = facts.quantities.map((q) => ({
  ...q,
  apart: numbers(q.apart, Float32Array),
  one: q.one ? numbers(q.one, Float32Array) : null,
  two: q.two ? numbers(q.two, Float32Array) : null,
}));

const slider = $('slider'), stage = $('stage'), play = $('play');
let row = facts.start, playing = 0, touched = false, scene = null;

const moment = (t) => `${t.toFixed(3)} s`;
const minus = (text) => text.replaceAll('-', '\u2212');

// Three significant digits, as in the tables; what is tiny or huge with its power of ten.
const figure = (value) => {
  const a = Math.abs(value);
  if (a === 0) return '0';
  if (a < 1e-3 || a >= 1e5) return minus(value.toExponential(0).replace('e+', 'e'));
  return minus(value.toFixed(Math.min(4, Math.max(0, 2 - Math.floor(Math.log10(a))))));
};
// What is a millionth of the tolerance is rounding.
const gap = (q, k) => (q.apart[k] && q.apart[k] < 1e-6 * q.tolerance ? '\u2248 0'
  : `${figure(q.apart[k])}${q.unit}`);
const apart = (q, k) => `${q.name} ${gap(q, k)}`;
const spoken = (k) => {
  const lead = facts.lead.map((n) => quantities[n]).filter(Boolean).map((q) => apart(q, k));
  return `${moment(times[k])}: ${lead.join('; ')} apart`;
};

const value = (q, v) => (v && Math.abs(v) < 1e-6 * q.tolerance ? '\u2248 0' : `${figure(v)}${q.unit}`);

// --- the table beside the scene -----------------------------------------------------------
const cells = [];
const build_readout = () => {
  for (const q of quantities) {
    const line = document.createElement('tr');
    const name = document.createElement('th');
    name.scope = 'row';
    name.textContent = q.name;
    line.append(name);
    const own = [0, 1, 2].map(() => line.appendChild(document.createElement('td')));
    $('readout').append(line);
    cells.push({ line, own });
  }
};
const fill_readout = () => {
  $('now').textContent = Math.abs(compared[row] - times[row]) > 1e-6
    ? `${moment(times[row])} (figures of ${moment(compared[row])})` : moment(times[row]);
  quantities.forEach((q, n) => {
    const { line, own } = cells[n];
    [q.one, q.two].forEach((side, k) => { own[k].textContent = side ? value(q, side[row]) : ''; });
    own[2].textContent = gap(q, row);
    line.className = q.apart[row] > q.tolerance ? 'beyond' : '';
  });
};

// --- one moment ---------------------------------------------------------------------------
// Drawn only when something has changed; where that takes long, coarsely until all stands still.
let asked = 0, settling = 0, slow = false;
const drawn = (how) => { $('scene').dataset.drawn = how; };
const draw = () => {
  asked = 0;
  scene.coarse = slow;
  const began = performance.now();
  scene.draw();
  drawn(slow ? 'coarse' : 'fine');
  if (slow) {
    settling = setTimeout(() => { scene.coarse = false; scene.draw(); drawn('fine'); }, 400);
  } else {
    requestAnimationFrame(() => { slow = slow || performance.now() - began > 120; });
  }
};
const redraw = () => {
  if (!scene || asked) return;
  clearTimeout(settling);
  drawn('no');
  asked = requestAnimationFrame(draw);
};
const show = (k, by_slider = false) => {
  row = Math.min(frames - 1, Math.max(0, k));
  const share = facts.until ? times[row] / facts.until : 0;
  document.body.style.setProperty('--t', share.toFixed(6));
  if (!by_slider) slider.value = row;
  slider.setAttribute('aria-valuetext', spoken(row));
  slider.style.setProperty('--t', share.toFixed(6));
  $('clock').textContent = moment(times[row]);
  fill_readout();
  if (scene) { scene.row = row; redraw(); }
};
const at_time = (t) => {
  let low = 0, high = frames - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t + 1e-6) low = middle; else high = middle - 1;
  }
  return low;
};

// What is said to those who hear the page: not more than once a second.
let waiting = 0, last_said = 0;
const say = (text) => {
  clearTimeout(waiting);
  waiting = setTimeout(() => { $('said').textContent = text; last_said = performance.now(); },
    Math.max(150, 1000 - (performance.now() - last_said)));
};

// --- playing ------------------------------------------------------------------------------
const stop = (why) => {
  if (!playing) return;
  cancelAnimationFrame(playing);
  playing = 0;
  play.textContent = 'Play';
  say(`${why} at ${spoken(row)}`);
};
const start = () => {
  if (playing || frames < 2) return;
  if (row >= frames - 1 || !touched) show(0);
  touched = true;
  play.textContent = 'Pause';
  say('Playing');
  let from = performance.now(), began = times[row];
  let speed = Number($('speed').value);
  const tick = (now) => {
    if (Number($('speed').value) !== speed) {
      speed = Number($('speed').value);
      from = now;
      began = times[row];
    }
    const t = began + ((now - from) / 1000) * speed;
    const next = at_time(t);
    if (next !== row) show(next);
    if (next >= frames - 1) { playing = 1; stop('Ended'); return; }
    playing = requestAnimationFrame(tick);
  };
  playing = requestAnimationFrame(tick);
};
const go_to = (k) => { stop('Paused'); touched = true; show(k); };

// --- controls -----------------------------------------------------------------------------
const reveal = (...names) => names.forEach((name) => { $(name).hidden = false; });

const controls = () => {
  reveal('slider', 'readout-box', 'theme');
  if (frames > 1) reveal('play', 'speeds');
  slider.addEventListener('input', () => {
    stop('Paused');
    touched = true;
    show(Number(slider.value), true);
  });
  play.addEventListener('click', () => (playing ? stop('Paused') : start()));
  for (const button of document.querySelectorAll('button.go')) {
    button.addEventListener('click', () => {
      go_to(at_time(Number(button.dataset.t)));
      say(spoken(row));
      const calm = matchMedia('(prefers-reduced-motion: reduce)').matches;
      stage.scrollIntoView({ behavior: calm ? 'auto' : 'smooth', block: 'start' });
    });
  }
  // A press on a chart or a lane goes to that moment.
  for (const area of document.querySelectorAll('.area, .lane:not(.slide):not(.axis) .track')) {
    const seek = (event) => {
      const box = area.getBoundingClientRect();
      go_to(at_time(((event.clientX - box.left) / box.width) * facts.until));
    };
    area.addEventListener('pointerdown', (event) => {
      if (event.button) return;
      seek(event);
      if (event.pointerType === 'mouse') area.setPointerCapture(event.pointerId);
    });
    area.addEventListener('pointermove', (event) => {
      if (event.pointerType === 'mouse' && event.buttons & 1) seek(event);
    });
  }
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const on = event.target;
    const free = on === document.body || on === slider || on === $('scene');
    if (!free) return;
    const box = stage.getBoundingClientRect();
    const seen = box.top < innerHeight && box.bottom > 0;
    if (event.key === ' ' && seen) {
      event.preventDefault();
      if (playing) stop('Paused'); else start();
    } else if (on === document.body && seen && event.key === 'ArrowLeft') go_to(row - 1);
    else if (on === document.body && seen && event.key === 'ArrowRight') go_to(row + 1);
  });
};

// --- the view -----------------------------------------------------------------------------
const turn = (dx, dy) => {
  scene.azimuth -= dx;
  scene.elevation = Math.min(1.5, Math.max(-0.2, scene.elevation + dy));
  redraw();
};
const zoom = (factor) => {
  const extent = facts.scene.extent;
  scene.distance = Math.min(20 * extent, Math.max(0.05 * extent, scene.distance * factor));
  redraw();
};
const whole = () => { scene.reset(); redraw(); };

const view = (canvas) => {
  const held = new Map();
  canvas.addEventListener('pointerdown', (event) => {
    held.set(event.pointerId, [event.clientX, event.clientY]);
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener('pointermove', (event) => {
    const before = held.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
    if (held.size === 2) {
      const other = [...held].find(([id]) => id !== event.pointerId)[1];
      const was = Math.hypot(before[0] - other[0], before[1] - other[1]);
      const is = Math.hypot(event.clientX - other[0], event.clientY - other[1]);
      if (was > 1 && is > 1) zoom(was / is);
    } else turn(dx * 0.008, dy * 0.008);
    held.set(event.pointerId, [event.clientX, event.clientY]);
  });
  for (const end of ['pointerup', 'pointercancel']) {
    canvas.addEventListener(end, (event) => held.delete(event.pointerId));
  }
  // The wheel scrolls the page, unless the picture was chosen before.
  canvas.addEventListener('wheel', (event) => {
    if (!event.ctrlKey && document.activeElement !== canvas) return;
    event.preventDefault();
    zoom(Math.exp(event.deltaY * 0.0015));
  }, { passive: false });
  const keys = {
    ArrowLeft: () => turn(0.1, 0), ArrowRight: () => turn(-0.1, 0),
    ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
    '+': () => zoom(0.85), '=': () => zoom(0.85), '-': () => zoom(1 / 0.85), 0: whole,
  };
  canvas.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || !(event.key in keys)) return;
    event.preventDefault();
    keys[event.key]();
  });
  $('view-all').addEventListener('click', whole);
  $('view-near').addEventListener('click', () => { scene.approach(); redraw(); });
  $('view-in').addEventListener('click', () => zoom(0.8));
  $('view-out').addEventListener('click', () => zoom(1.25));
  $('view-near').hidden = !scene.sides[0].tip;
  for (const name of Object.keys(scene.show)) {
    $(name).checked = true;
    $(name).addEventListener('change', () => { scene.show[name] = $(name).checked; redraw(); });
  }
  new ResizeObserver(redraw).observe(canvas);
};

const begin_scene = () => {
  const canvas = $('scene');
  if (!facts.scene) return;
  canvas.hidden = false;
  try {
    scene = new Scene(canvas, facts.scene, frames);
  } catch (error) {
    canvas.hidden = true;
    const why = error.message === 'no WebGL' ? 'This browser has no WebGL 2'
      : `The picture cannot be drawn (${error.message})`;
    $('no-scene').textContent = `${why}; the figures follow the slider.`;
    $('no-scene').hidden = false;
    return;
  }
  $('still').hidden = true;
  reveal('views', 'checks', 'arrows');
  view(canvas);
};

// --- dark, light and print ----------------------------------------------------------------
const dark = matchMedia('(prefers-color-scheme: dark)');
const is_dark = () => (root.dataset.theme ? root.dataset.theme === 'dark' : dark.matches);
const themed = () => {
  $('theme').textContent = is_dark() ? 'Light' : 'Dark';
  $('theme').setAttribute('aria-label', is_dark() ? 'Light colours' : 'Dark colours');
  redraw();
};
$('theme').addEventListener('click', () => {
  root.dataset.theme = is_dark() ? 'light' : 'dark';
  themed();
});
dark.addEventListener('change', themed);

let printed = null;
addEventListener('beforeprint', () => {
  stop('Paused');
  printed = { theme: root.dataset.theme, closed: [...document.querySelectorAll('details:not([open])')] };
  root.dataset.theme = 'light';
  for (const part of printed.closed) part.open = true;
  if (!scene) return;
  scene.draw();
  const picture = new Image();
  picture.src = $('scene').toDataURL('image/png');
  picture.alt = `Both runs at ${spoken(row)}`;
  picture.id = 'printed';
  $('scene').before(picture);
});
addEventListener('afterprint', () => {
  if (!printed) return;
  if (printed.theme) root.dataset.theme = printed.theme; else delete root.dataset.theme;
  for (const part of printed.closed) part.open = false;
  $('printed')?.remove();
  printed = null;
  redraw();
});

build_readout();
begin_scene();
controls();
themed();
show(row);
