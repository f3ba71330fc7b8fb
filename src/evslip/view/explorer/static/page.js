// What every page needs: its elements and colours, the server's answers, a place for complaints.
export const place = (id) => document.getElementById(id);

export const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

export function element(tag, properties, ...inside) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...inside);
  return made;
}

export async function get(url) {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error((await answer.text()).trim());
  return answer.json();
}

export const complain = (error) => { place("problem").textContent = error.message; };
