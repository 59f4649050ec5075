"use strict";
// The comparison of two pictures: which ones, and where one ends and the other begins.
const one = document.getElementById("one"), other = document.getElementById("other"), edge = document.getElementById("edge");
const under = document.getElementById("under"), over = document.getElementById("over");
const of = (name) => document.querySelector(`img[data-name="${CSS.escape(name)}"]`);
function show() {
  over.src = of(one.value).src;
  under.src = of(other.value).src;
  over.alt = one.value;
  under.alt = other.value;
  over.style.clipPath = `inset(0 ${100 - edge.value}% 0 0)`;
}
if (one && one.length) {
  // The setting in use stands on the left, beside the first that is recommended, or the reference.
  other.selectedIndex = Math.min(1, other.length - 1);
  for (const control of [one, other, edge]) control.addEventListener("input", show);
  show();
}
// What a pointer shows where it rests is told of what has the focus, too.
const told = document.getElementById("told");
const words = (of) => of.getAttribute("aria-label") ?? of.title;
for (const of of document.querySelectorAll("g[tabindex]")) {
  for (const event of ["focus", "pointerenter"]) of.addEventListener(event, () => { told.textContent = words(of); });
}
for (const of of document.querySelectorAll("td[tabindex]")) {
  of.addEventListener("focus", () => { of.dataset.told = words(of); });
  of.addEventListener("blur", () => { delete of.dataset.told; });
}
