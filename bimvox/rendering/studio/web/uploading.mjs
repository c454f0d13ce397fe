// Files that are dropped on the page, or chosen, and put into the folder of the studio.
import { byId } from "../page/dom.mjs";
import { send } from "./api.mjs";
import { ask } from "./dialogs.mjs";

const OBSTRUCTIONS = ".obstructions.json";

export class Uploading {
  constructor(app) {
    this.app = app;
    addEventListener("dragover", (event) => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      document.body.classList.add("dropping");
    });
    addEventListener("dragleave", (event) => !event.relatedTarget && document.body.classList.remove("dropping"));
    addEventListener("drop", (event) => {
      document.body.classList.remove("dropping");
      if (!event.dataTransfer?.files.length) return;
      event.preventDefault();
      this.take([...event.dataTransfer.files]);
    });
    byId("chosen-files").addEventListener("change", (event) => {
      this.take([...event.target.files]);
      event.target.value = "";
    });
  }

  /** Let the person choose files. */
  choose() {
    byId("chosen-files").click();
  }

  /** Put files into the folder; then open the first site file or model of them. */
  async take(files) {
    const { app } = this;
    document.querySelectorAll("dialog[open]").forEach((dialog) => dialog.close());
    const put = [];
    try {
      for (const file of files) {
        app.announce(`${file.name} is copied`);
        const path = await this.put(file, this.pathOf(file.name));
        if (path) put.push(path);
      }
    } catch (error) {
      app.fail(error);
    }
    if (!put.length) return;
    const first = put.find((path) => path.endsWith(".site.toml")) ?? put.find((path) => /\.(ifc|ifczip|stl|obj|ply|off|glb|gltf|3mf)$/i.test(path));
    app.say(`In the folder now: ${put.join(", ")}.`, null, "aside");
    if (first) await app.openFile(first);
    app.state.look();
  }

  /** Where a file goes: obstructions are those of the site that is open. */
  pathOf(name) {
    const { opened } = this.app;
    return opened && /\.json$/i.test(name) ? opened.path.replace(/\.site\.toml$/, OBSTRUCTIONS) : name;
  }

  /** Put a file into the folder and return its path; null if the person keeps another one of that name. */
  async put(file, path, over = "") {
    const address = `/api/upload?path=${encodeURIComponent(path)}${over ? `&over=${over}` : ""}`;
    try {
      return (await send(address, file)).path;
    } catch (error) {
      if (error.status !== 409 || !error.sha256) throw error;
      const answer = await ask("A file of this name is there", error.message, [["replace", "Replace it"], [null, "Keep it"]]); // prettier-ignore
      return answer ? this.put(file, path, error.sha256) : null;
    }
  }
}
