// Asks for the page again every ten seconds and changes only what reads otherwise, so that focus, selection and places of
// scrolling stay. The browser asks with the tag of what it has: while nothing changed, nothing is sent.
"use strict";
const EVERY_MS = 10_000;

function morph(now, next) {
  if (now.isEqualNode(next)) return;
  const same = now.nodeName === next.nodeName && now.childNodes.length === next.childNodes.length;
  if (!same || now.nodeType !== Node.ELEMENT_NODE) return void now.replaceWith(next);
  for (const { name } of [...now.attributes]) if (!next.hasAttribute(name)) now.removeAttribute(name);
  for (const { name, value } of next.attributes) if (now.getAttribute(name) !== value) now.setAttribute(name, value);
  const nexts = [...next.childNodes];
  [...now.childNodes].forEach((child, i) => morph(child, nexts[i]));
}

function note(text) {
  for (const place of document.querySelectorAll("[data-note]")) place.textContent = text;
}

async function refresh() {
  if (document.hidden) return;
  try {
    const answer = await fetch(location.href, { cache: "no-cache", headers: { accept: "text/html" } });
    if (!answer.ok) throw new Error(answer.statusText);
    const page = new DOMParser().parseFromString(await answer.text(), "text/html");
    for (const part of document.querySelectorAll("[data-live]")) {
      const next = page.getElementById(part.id);
      if (next) morph(part, document.importNode(next, true));
    }
    note("Live.");
  } catch {
    note("Not reachable: what is shown is old.");
  }
}

document.addEventListener("keydown", (event) => {
  const typing = /^(INPUT|TEXTAREA|SELECT)$/.test(document.activeElement.nodeName);
  if (event.key !== "/" || typing || event.ctrlKey || event.metaKey || event.altKey) return;
  const search = document.querySelector("[data-search]");
  if (search) { event.preventDefault(); search.focus(); }
});
setInterval(refresh, EVERY_MS);
document.addEventListener("visibilitychange", refresh);
