// Shows the page in the language of WORDS, a catalogue in languages/ that the server has chosen by the browser's
// wish. Texts come from many places (nodes' reports, parameters, scripts), so they are replaced where they are shown:
// in each text and in the attributes below, before the browser draws it. "#" in a key stands for a number, "{}" for
// any other text, which is translated in turn, or stays as it is where the translation has "{=}", as what is to be
// typed has to; all keep their order. What has translate="no" stays as it is.

(() => {
  const NUMBER = /(?<!\S)--(?!\S)|(?<![\p{L}\d])[+-]?\d+(?:\.\d+)?/gu;
  const ATTRIBUTES = ["title", "aria-label", "placeholder", "alt"];
  const KEPT = "title, script, style, [translate=no], .nicegui-error-popup, #esm-fallback, .setting .q-field__native, .identifiers";
  const UNITS = /\b(m|s|ms|deg|rad|Hz|kB|MB|GB|px|fps|kbit)\b/g;
  // Of a topic, a parameter, a file.
  const IDENTIFIER = /^[^\s<>]*[\w-][._\/][\w-][^\s<>]*$|^\/\S+$/u;
  const MOST_REMEMBERED = 2000;

  const exact = new Map();
  const templates = [];
  for (const [key, words] of Object.entries(WORDS)) {
    exact.set(lowered(key), words);
    if (key.includes("{}")) templates.push({ key, words, literal: key.replaceAll("{}", "").length });
  }
  // The most specific first.
  templates.sort((one, other) => other.literal - one.literal);
  for (const template of templates) {
    const parts = template.key.split(/(\{\}|#)/).map((part) =>
      part === "{}" ? "(.+?)" : part === "#" ? `(${NUMBER.source})` : escaped(part));
    template.pattern = new RegExp(`^${parts.join("")}$`, "isu");
  }

  function escaped(part) {
    return part.replace(/[.*+?^${}()|[\]\\/]/g, "\\$&");
  }

  function lowered(words) {
    return words.charAt(0).toLowerCase() + words.slice(1);
  }

  // Puts the values into the places of "#", "{}" and "{=}", one after the other.
  function filled(words, values) {
    let next = 0;
    return words.replace(/\{=?\}|#/g, (place) => {
      const value = values[next++] ?? place;
      return place === "{}" ? partOf(value) ?? value : value;
    });
  }

  // Of each text, its translation, or null.
  const remembered = new Map();
  // Texts without a translation, for those who add one.
  const untranslated = window.untranslated = new Set();

  function translated(words) {
    if (!remembered.has(words)) {
      if (remembered.size >= MOST_REMEMBERED) remembered.clear();
      remembered.set(words, lookedUp(words));
    }
    return remembered.get(words);
  }

  function lookedUp(words) {
    const known = exact.get(lowered(words.replace(NUMBER, "#")));
    if (known !== undefined) return asCapital(filled(known, words.match(NUMBER) ?? []), words);
    for (const { words: form, pattern } of templates) {
      const found = pattern.exec(words);
      if (found) return asCapital(filled(form, found.slice(1)), words);
    }
    return joined(words);
  }

  // Sentences in a row, a name before a colon, and the like: each part by itself.
  function joined(words) {
    for (const mark of ["; ", ". ", " · ", ": "]) {
      const end = words.indexOf(mark);
      if (end < 1) continue;
      const parts = [words.slice(0, end), words.slice(end + mark.length)];
      const results = parts.map(partOf);
      if (results.every((result) => result === null)) continue;
      return results.map((result, n) => result ?? unknown(parts[n])).join(mark);
    }
    const ended = words.endsWith(".") ? translated(words.slice(0, -1)) : null;
    return ended && `${ended}.`;
  }

  function partOf(words) {
    return hasWords(words) ? translated(words) : words;
  }

  function hasWords(words) {
    return /\p{L}{2}/u.test(words.replace(UNITS, "")) && !IDENTIFIER.test(words);
  }

  function unknown(words) {
    if (untranslated.size < MOST_REMEMBERED) untranslated.add(words);
    return words;
  }

  function asCapital(words, like) {
    return /^\p{Lu}/u.test(like) ? words.charAt(0).toUpperCase() + words.slice(1) : words;
  }

  function inLanguage(text) {
    const words = text.trim();
    return hasWords(words) ? text.replace(words, () => translated(words) ?? unknown(words)) : text;
  }

  // What was last written to a text or an attribute, which is not to be translated again.
  const written = new WeakMap();

  function translateText(node) {
    if (written.get(node) === node.data || node.parentElement?.closest(KEPT)) return;
    const words = inLanguage(node.data);
    written.set(node, words);
    if (words !== node.data) node.data = words;
  }

  function translateAttribute(element, name) {
    const value = element.getAttribute(name);
    const before = written.get(element) ?? {};
    if (value === null || before[name] === value || element.closest(KEPT)) return;
    const words = inLanguage(value);
    written.set(element, { ...before, [name]: words });
    if (words !== value) element.setAttribute(name, words);
  }

  function translateAll(root) {
    if (root.nodeType === Node.TEXT_NODE) return translateText(root);
    if (root.nodeType !== Node.ELEMENT_NODE) return;
    const walker = document.createTreeWalker(root, NodeFilter.SHOW_TEXT | NodeFilter.SHOW_ELEMENT);
    for (let node = root; node; node = walker.nextNode()) {
      if (node.nodeType === Node.TEXT_NODE) translateText(node);
      else for (const name of ATTRIBUTES) if (node.hasAttribute(name)) translateAttribute(node, name);
    }
  }

  new MutationObserver((changes) => {
    for (const { type, target, addedNodes, attributeName } of changes) {
      if (type === "characterData") translateText(target);
      else if (type === "attributes") translateAttribute(target, attributeName);
      else addedNodes.forEach(translateAll);
    }
  }).observe(document.documentElement, { subtree: true, childList: true, characterData: true, attributeFilter: ATTRIBUTES });
  translateAll(document.documentElement);
})();
