// Tables and code that scroll can be scrolled by the keyboard; the button that copies code is no place to navigate to.
document$.subscribe(() => requestAnimationFrame(() => {
  for (const place of document.querySelectorAll(".md-typeset__scrollwrap, .md-typeset pre > code")) place.tabIndex = 0;
  for (const buttons of document.querySelectorAll(".md-code__nav")) buttons.setAttribute("role", "none");
}));
