// What every page needs: its elements and colours, the server's answers, a place for complaints.
export const place = (id) => document.getElementById(id);

export const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

export function element(tag, properties, ...inside) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...inside);
  return made;
}

// The program behind the page does not answer.
export class Ended extends Error {
  constructor() { super("the program that shows this page has ended, or cannot be reached"); }
}

// As fetch, but what was refused is an error, whose message says why.
export async function ask(url, options) {
  const answer = await fetch(url, options).catch(() => { throw new Ended(); });
  if (!answer.ok) throw new Error((await answer.text()).trim());
  return answer;
}

export const get = async (url) => (await ask(url)).json();

export const complain = (error) => { place("problem").textContent = error.message; };
