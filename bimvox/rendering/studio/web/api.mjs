// Requests to the server on this machine. An error is the sentence that the command line would print.

export class ApiError extends Error {
  constructor(status, { error, where, hint, sha256 }) {
    super(error);
    Object.assign(this, { status, where: where ?? null, hint: hint ?? null, sha256: sha256 ?? null });
  }
}

const asked = new URLSearchParams(location.search);
export const token = asked.get("token") ?? "";
/** What the command line named, to open first; null if nothing. */
export const first = asked.get("open");

export async function call(method, path, body, signal) {
  return (await answered(method, path, body, signal)).json();
}

/** Send the content of a file. */
export async function send(path, file) {
  return (await answered("POST", path, file)).json();
}

/** The answer of a request that went well. */
async function answered(method, path, body, signal) {
  let answer;
  try {
    answer = await fetch(path, {
      method,
      signal,
      headers: { "X-Bimvox-Token": token, ...(body && !(body instanceof Blob) ? { "Content-Type": "application/json" } : {}) },
      body: body instanceof Blob ? body : body ? JSON.stringify(body) : undefined,
    });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new ApiError(0, { error: "The studio does not answer.", hint: "Start `bimvox studio` again; what you see here is not lost until you close this page." });
  }
  if (answer.ok) return answer;
  const found = await answer.json().catch(() => null);
  throw new ApiError(answer.status, found?.error ? found : { error: `The studio answered with status ${answer.status}.` });
}

/** A picture of a set-up: its address, and where the ground is in it, {size, corners: [[x, y, dx, dy]]}, pixels and pixels a metre up. */
export async function picture(body) {
  const answer = await answered("POST", "/api/picture", body);
  const content = await answer.blob();
  return new Promise((done, failed) => {
    const reader = new FileReader();
    reader.onload = () => done({ address: reader.result, ground: JSON.parse(answer.headers.get("X-Bimvox-Ground")) });
    reader.onerror = () => failed(reader.error);
    reader.readAsDataURL(content);
  });
}

/** Sends only the latest request: one is under way, the next one waits, those between are discarded. */
export class Latest {
  /** @param send (value) => promise; @param done (answer, value), @param failed (error) */
  constructor(send, done, failed) {
    Object.assign(this, { send, done, failed, busy: false, next: null });
  }

  async ask(value) {
    if (this.busy) {
      this.next = { value };
      return;
    }
    this.busy = true;
    try {
      const answer = await this.send(value);
      this.done(answer, value);
    } catch (error) {
      this.failed(error);
    } finally {
      this.busy = false;
      const { next } = this;
      this.next = null;
      if (next) this.ask(next.value);
    }
  }
}
