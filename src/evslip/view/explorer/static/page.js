// What every page needs: its elements, the server's answers, a place for complaints.
export const place = (id) => document.getElementById(id);

export async function get(url) {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error((await answer.text()).trim());
  return answer.json();
}

export const complain = (error) => { place("problem").textContent = error.message; };
