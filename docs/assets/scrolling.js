// Tables and code that scroll can be scrolled by the keyboard.
document$.subscribe(() => requestAnimationFrame(() => {
  for (const place of document.querySelectorAll(".md-typeset__scrollwrap, .md-typeset pre > code")) place.tabIndex = 0;
}));
