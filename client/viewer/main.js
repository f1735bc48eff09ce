// Shows what the page carries: the result of a detection, or a model.
import { showModel } from "./model.js";
import { showResult } from "./result.js";

const started = performance.now();
try {
  const data = JSON.parse(document.getElementById("data").textContent);
  const title = data.kind === "model" ? data.model.id : data.request.requestId;
  document.title = `${title} - binpose`;
  const heading = document.querySelector("h1");
  heading.textContent = title.split("/").findLast((name) => name !== "") ?? "";
  heading.title = title;
  ({ result: showResult, model: showModel })[data.kind](data);
  document.body.dataset.state = "ready";
  document.body.dataset.milliseconds = Math.round(performance.now() - started);
} catch (error) {
  const fault = document.getElementById("fault");
  fault.hidden = false;
  fault.textContent = `This page cannot be shown: ${error.message}`;
  document.body.dataset.state = "failed";
  throw error;
}
