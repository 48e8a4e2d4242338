// Plots the last seconds of one velocity as two lines. The server sends each sample once; they are stored here.

const HALF = 50; // the drawing is 100 units high, with zero in the middle

export default {
  template: `
    <div class="plot" role="img">
      <svg preserveAspectRatio="none" :viewBox="'0 0 ' + span + ' 100'">
        <path class="grid" :d="grid" />
        <path class="measured" :d="measured" /><path class="commanded" :d="commanded" />
      </svg>
      <span class="most">{{ most }}</span><span class="least">{{ -most }}</span>
    </div>`,
  props: { span: Number, least: Number },
  data: () => ({ rows: [], most: 1 }),
  computed: {
    grid() {
      const seconds = Array.from({ length: this.span / 10 - 1 }, (_, i) => `M${10 * (i + 1)} 0V100`);
      return `M0 ${HALF}H${this.span}${seconds.join("")}`;
    },
    commanded() { return this.line(1); },
    measured() { return this.line(2); },
  },
  mounted() {
    this.$emit("begin");
  },
  methods: {
    // rows: [seconds, commanded, measured], null if missing
    add(rows, afresh) {
      const known = afresh ? [] : this.rows;
      const begin = rows.length ? rows[rows.length - 1][0] - this.span : -Infinity;
      this.rows = [...known, ...rows].filter((row) => row[0] >= begin);
      this.most = this.reach();
    },
    reach() {
      const largest = Math.max(this.least, ...this.rows.flatMap(([, ...values]) => values.map(Math.abs)));
      const power = 10 ** Math.floor(Math.log10(largest));
      return [1, 2, 5, 10].map((digit) => +(digit * power).toPrecision(1)).find((most) => most >= largest * 0.999);
    },
    line(column) {
      const { rows, span, most } = this;
      if (!rows.length) return "";
      const begin = rows[rows.length - 1][0] - span;
      let path = "", last = -Infinity;
      for (const row of rows) {
        if (row[column] === null) { last = -Infinity; continue; }
        const joined = row[0] - last < 0.5;
        path += `${joined ? "L" : "M"}${(row[0] - begin).toFixed(2)} ${(HALF - (HALF * row[column]) / most).toFixed(1)}`;
        last = row[0];
      }
      return path;
    },
  },
};
