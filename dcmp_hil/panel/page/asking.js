// Requests to the page's server, and the list of its answers.

export const by = (id) => document.getElementById(id);
const ANSWERS_MAX = 4; // lines

export async function post(path, body) {
  const answer = await fetch(path, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(body ?? {}),
  });
  if (!answer.headers.get("Content-Type").startsWith("application/json")) {
    return { ok: false, said: await answer.text() };
  }
  return answer.json();
}

export function log(reply) {
  const line = document.createElement("li");
  line.textContent = reply.said;
  line.className = reply.ok ? "" : "bad";
  by("log").prepend(line);
  while (by("log").children.length > ANSWERS_MAX) by("log").lastChild.remove();
}
