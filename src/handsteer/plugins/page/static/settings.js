// The index of the settings: unfolded beside the sections on wide screens, a menu on phones; marks the section in view.
const WIDE = matchMedia("(min-width: 1000px)");

function place() {
  const index = document.querySelector(".index");
  if (index) index.open = WIDE.matches;
}

function mark() {
  const links = [...document.querySelectorAll(".index a:not(.hidden)")];
  const top = (link) => document.querySelector(link.hash)?.getBoundingClientRect().top ?? Infinity;
  const isAtEnd = scrollY > 0 && innerHeight + scrollY >= document.documentElement.scrollHeight - 2;
  const passed = links.filter((link) => top(link) < innerHeight * 0.35);
  const seen = isAtEnd && links.at(-1) && location.hash === links.at(-1).hash ? links.at(-1) : passed.at(-1) ?? links[0];
  for (const link of links) {
    if (link === seen) link.setAttribute("aria-current", "true");
    else link.removeAttribute("aria-current");
  }
}

document.addEventListener("click", (event) => {
  const link = event.target.closest?.('.settings a[href^="#"]');
  if (!link) return;
  event.preventDefault();
  const section = document.querySelector(link.hash);
  section.open = true;
  history.replaceState(null, "", link.hash);
  if (!WIDE.matches) place();
  section.scrollIntoView();
  section.querySelector("summary").focus({ preventScroll: true });
});
addEventListener("scroll", mark, { passive: true });
addEventListener("load", () => {
  place();
  mark();
  WIDE.addEventListener("change", place);
});
