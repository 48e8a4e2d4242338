// Plots the last seconds of one velocity by uPlot. The server sends each sample once; they are stored here.

const GAP_S = 0.5, CURSOR_STEP = 10;
const KEYS = { ArrowLeft: -CURSOR_STEP, ArrowRight: CURSOR_STEP };

const shown = new Set(); // zoomed and paused together

// Rounded up to 1, 2 or 5 times a power of ten.
function roundedUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((digit) => +(digit * power).toPrecision(1)).find((most) => most >= value * 0.999);
}

export default {
  template: `<div class="plot" role="img" tabindex="0" @keydown="move"><output aria-live="off">{{ values }}</output></div>`,
  props: { span: Number, least: Number, times: Boolean, form: String },
  data: () => ({ values: "" }),
  mounted() {
    this.rows = [];
    this.most = this.least;
    this.isPaused = false;
    this.plot = new uPlot(this.options(), [[], [], []], this.$el);
    this.watch = new ResizeObserver(() => this.plot.setSize(this.size()));
    this.watch.observe(this.$el);
    this.theme = new MutationObserver(() => this.plot.redraw(false));
    this.theme.observe(document.body, { attributeFilter: ["class"] });
    shown.add(this);
    this.$emit("begin");
  },
  unmounted() {
    shown.delete(this);
    this.watch.disconnect();
    this.theme.disconnect();
    this.plot.destroy();
  },
  methods: {
    // rows: [seconds, commanded, measured], null if missing
    add(rows, afresh) {
      const known = afresh ? [] : this.rows;
      const begin = rows.length ? rows[rows.length - 1][0] - this.span : -Infinity;
      this.rows = [...known, ...rows].filter((row) => row[0] >= begin);
      if (!this.isPaused) this.draw();
    },
    pause(on) {
      this.isPaused = on;
      if (!on) this.draw();
    },
    zoom(plot) {
      const { left, width } = plot.select;
      if (!width) return;
      const [min, max] = [left, left + width].map((at) => plot.posToVal(at, "x"));
      plot.setSelect({ left: 0, width: 0 }, false);
      for (const each of shown) {
        each.pause(true);
        each.plot.setScale("x", { min, max });
      }
      this.$emit("zoom");
    },
    draw() {
      const { rows, span } = this;
      const last = rows.length ? rows[rows.length - 1][0] : 0;
      const data = [[], [], []];
      rows.forEach((row, index) => {
        if (index && row[0] - rows[index - 1][0] > GAP_S) data.forEach((column, i) => column.push(i ? null : rows[index - 1][0] - last + 0.01));
        row.forEach((value, i) => data[i].push(i ? value : value - last));
      });
      this.rescale();
      this.plot.batch(() => {
        this.plot.setData(data, false);
        this.plot.setScale("x", { min: -span, max: 0 });
      });
      this.read(this.plot);
    },
    // Grows at once, and shrinks only well below the next step, so that it does not jump to and fro.
    rescale() {
      const largest = Math.max(this.least, ...this.rows.flatMap(([, ...values]) => values.map(Math.abs)));
      if (largest > this.most * 1.001 || largest < this.most * 0.35) this.most = Math.max(roundedUp(largest), this.least);
    },
    read(plot) {
      const at = plot.cursor.idx;
      const [seconds, commanded, measured] = plot.data.map((column) => column[at] ?? null);
      const words = (value) => (value === null ? "--" : value.toFixed(2));
      this.values = seconds === null ? "" : this.form
        .replace("{seconds}", Math.abs(seconds).toFixed(1))
        .replace("{commanded}", words(commanded))
        .replace("{measured}", words(measured));
    },
    move(event) {
      const step = KEYS[event.key];
      if (!step) return;
      event.preventDefault();
      const { width, height } = this.plot.over.getBoundingClientRect();
      const left = this.plot.cursor.left < 0 ? width : this.plot.cursor.left;
      this.plot.setCursor({ left: Math.min(Math.max(left + step, 0), width - 1), top: height / 2 });
    },
    size() {
      return { width: Math.max(this.$el.clientWidth, 50), height: Math.max(this.$el.clientHeight, 40) };
    },
    options() {
      const colour = (name) => () => getComputedStyle(this.$el).getPropertyValue(`--${name}`);
      const grid = { stroke: colour("grid"), width: 1 };
      const axis = { stroke: colour("faint"), font: "11px system-ui, sans-serif", grid, ticks: { show: false } };
      return {
        ...this.size(),
        padding: [6, 8, 0, 0],
        legend: { show: false },
        cursor: { sync: { key: "velocity", scales: ["x", null] }, y: false, points: { size: 6 }, drag: { setScale: false } },
        scales: { x: { time: false, range: (_, min, max) => [min, max] }, y: { range: () => [-1.15 * this.most, 1.15 * this.most] } },
        series: [
          {},
          { stroke: colour("ink"), width: 1.4, dash: [5, 3], points: { show: false } },
          { stroke: colour("accent"), width: 2, points: { show: false } },
        ],
        axes: [
          { ...axis, size: this.times ? 18 : 4, gap: 2, space: 80, values: (_, splits) => splits.map((at) => (this.times ? `${+at.toFixed(2)} s` : "")) },
          { ...axis, size: 34, gap: 4, splits: () => [-this.most, 0, this.most], values: (_, splits) => splits.map((at) => `${+at.toFixed(2)}`) },
        ],
        hooks: {
          setCursor: [(plot) => this.read(plot)],
          setSelect: [(plot) => this.zoom(plot)],
        },
      };
    },
  },
};
