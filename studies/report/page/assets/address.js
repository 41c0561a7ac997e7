// The address of a case, #case=ID: it opens the case, follows what is chosen, and goes back.

/** The case in the address; null where it names none. */
function addressed() {
  return location.hash.startsWith("#case=") ? location.hash.slice(6) : null;
}

/** Opens the case in the address; without one the first, and where it is unknown the first with a sentence. */
async function follow() {
  const id = addressed(), known = id !== null && id in DATA.cases;
  byId("unknown").hidden = id === null || known;
  byId("unknown").textContent = `This page holds no case ${id}; the first one is shown instead.`;
  if (id === null && location.hash !== "") return; // a part of the page
  const wanted = known ? id : DATA.first;
  if (wanted !== state.id) await choose(wanted);
}

/** Puts the case before the reader's eyes. */
function toCase() {
  byId("case").scrollIntoView();
  byId("chosen").focus({ preventScroll: true });
}

if (Object.keys(DATA.cases).length) {
  begin();
  document.addEventListener("click", (event) => {
    if (event.target.closest?.('a[href^="#case="]')) setTimeout(toCase);
  });
  addEventListener("hashchange", follow);
  if (addressed() === null) choose(DATA.first);
  else follow().then(toCase);
}
showTheme();
