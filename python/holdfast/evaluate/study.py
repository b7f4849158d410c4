# SPDX-License-Identifier: MIT
"""A perceptual study: films of two sets of clips side by side, and a page that records choices.

As in the studies of IMoS (Ghosh et al. 2023, sec. 5) and WANDR: people see two motions of the same
name at a time, in random order and on random sides, and choose one of them for each question.
--read computes how often each set was chosen.
"""

import html
import json
import math
import pathlib
import random

import holdfast
from holdfast.evaluate import _study

QUESTIONS = ["Which motion looks more realistic?", "Which motion matches the description better?"]

PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Comparison of motions</title><style>
body { font: 16px/1.5 sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em }
.pair { display: flex; gap: 1em } .pair video { width: 50% }
fieldset { border: 0; padding: 0; margin: 1em 0 } button { font: inherit; padding: .4em 1.2em }
</style></head><body>
<h1>Comparison of motions</h1>
<p id="place"></p><p id="text"></p>
<div class="pair"><video id="A" controls loop muted></video><video id="B" controls loop muted></video></div>
<form id="form"></form>
<p><button id="next">Next</button> <a id="save" hidden>Save the answers</a></p>
<script>
const study = __STUDY__;
const shuffled = list => list.map(x => [Math.random(), x]).sort((a, b) => a[0] - b[0]).map(p => p[1]);
const $ = id => document.getElementById(id);
const key = "holdfast-study-" + study.id;
let state = JSON.parse(localStorage.getItem(key) || "null") || {
  id: study.id, participant: Math.random().toString(36).slice(2), answers: [],
  order: shuffled(study.pairs.map((_, i) => ({pair: i, swapped: Math.random() < 0.5})))};
function show() {
  localStorage.setItem(key, JSON.stringify(state));
  const done = state.answers.length, all = state.order.length;
  if (done === all) {
    $("place").textContent = "Thank you. Please save the answers and send the file.";
    for (const id of ["A", "B", "form", "next", "text"]) $(id).hidden = true;
    const link = $("save");
    link.href = "data:application/json," + encodeURIComponent(JSON.stringify(
        {id: state.id, participant: state.participant, answers: state.answers}));
    link.download = "answers_" + state.participant + ".json";
    link.hidden = false;
    return;
  }
  const {pair, swapped} = state.order[done], {films, text} = study.pairs[pair];
  $("place").textContent = `${done + 1} of ${all}`;
  $("text").textContent = text;
  ["A", "B"].forEach((id, i) => { $(id).src = films[swapped ? 1 - i : i]; $(id).play(); });
  $("form").innerHTML = study.questions.map((question, q) =>
    `<fieldset><legend>${question}</legend>` + ["Left", "Right"].map((side, i) =>
      `<label><input type="radio" name="q${q}" value="${i}"> ${side}</label> `).join("") + "</fieldset>").join("");
}
$("next").onclick = () => {
  const chosen = study.questions.map((_, q) => new FormData($("form")).get("q" + q));
  if (chosen.includes(null)) { alert("Please answer all questions."); return; }
  const {pair, swapped} = state.order[state.answers.length];
  state.answers.push({pair, chosen: chosen.map(i => swapped ? 1 - Number(i) : Number(i))});
  show();
};
show();
</script></body></html>
"""


def clips_of(folder):
    """{name: path} of the clips (.npz) and result folders in a folder."""
    if not folder.is_dir():
        raise holdfast.Error(f"{folder}: is not a folder of clips. Give LABEL=FOLDER")
    found = {path.stem: path for path in folder.glob("*.npz")}
    found.update({path.name: path for path in folder.iterdir() if (path / "clip.npz").is_file()})
    return found


def pairs_of(sets, count, seed):
    """Pairs (label, other label, name) of the same name in two sets, in random order."""
    labels = list(sets)
    pairs = [(a, b, name) for i, a in enumerate(labels) for b in labels[i + 1:]
             for name in sorted(sets[a].keys() & sets[b].keys())]
    if not pairs:
        raise holdfast.Error("study: no two folders have a clip of the same name. Name the clips "
                             "of a pair alike")
    random.Random(seed).shuffle(pairs)
    return pairs[:count] if count else pairs


def described(clip, name):
    """What people are told of a clip: its action and object, else its name."""
    action = getattr(clip, "action", "")
    thing = clip.object.name if clip.object is not None else ""
    return f"{action} {thing}".strip() or name.replace("_", " ")


def draw(task):
    """Renders one film."""
    holdfast.render(task["clip"], task["film"], camera=task["camera"], size=task["size"], fps=task["fps"],
                    contact=False, force=True, threads=1)
    return True


def make(options, sets):
    """Writes films, key.json (which film is of which set) and index.html."""
    pairs = pairs_of(sets, options.pairs, options.seed)
    names = random.Random(options.seed + 1)
    films = options.output / "films"
    films.mkdir(parents=True, exist_ok=True)
    tasks, key, shown = {}, [], []
    for a, b, name in pairs:
        files = []
        for label in (a, b):
            film = f"{names.getrandbits(48):012x}.mp4"  # does not tell the set
            tasks[film] = {"clip": str(sets[label][name]), "film": str(films / film), "camera": options.camera,
                           "size": (options.size, options.size), "fps": options.fps}
            files.append(f"films/{film}")
        key.append({"name": name, "sets": [a, b], "films": files})
        shown.append({"films": files, "text": described(holdfast.Clip.load(str(sets[a][name])), name)})
    question = [sorted((film, task["camera"], task["size"], task["fps"], _study.contents(task["clip"]))
                       for film, task in tasks.items())]
    store = _study.Store(options.output, "films", question, options.force)
    store.run(draw, tasks, options.jobs)
    study = {"id": f"{names.getrandbits(64):016x}", "pairs": shown,
             "questions": [html.escape(question) for question in options.question]}
    text = json.dumps(study).replace("</", "<\\/")
    _study.write_json(options.output / "key.json", {"id": study["id"], "questions": options.question, "pairs": key})
    _study.write_atomically(options.output / "index.html", PAGE.replace("__STUDY__", text))
    print(f"{options.output / 'index.html'}: {len(pairs)} pairs. Publish index.html and films/, collect the "
          "answers that the page saves, and read them with --read.")
    return 0


def wilson(chosen, count):
    """Wilson's 95 % interval of a fraction."""
    z, share = 1.96, chosen / count
    middle = (share + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    return middle - half, middle + half


def read_answers(path, key):
    """[(pair, chosen of each question)] of one file of answers."""
    try:
        file = json.loads(path.read_text(encoding="utf-8"))
        answers = [(int(entry["pair"]), [int(value) for value in entry["chosen"]]) for entry in file["answers"]]
        known = file["id"] == key["id"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise holdfast.Error(f"{path}: is not a file of answers ({error}). Give what the page saved") from error
    if not known:
        raise holdfast.Error(f"{path}: is of another study. Give the answers of {key['id']}")
    for pair, chosen in answers:
        if not 0 <= pair < len(key["pairs"]) or len(chosen) != len(key["questions"]) or set(chosen) - {0, 1}:
            raise holdfast.Error(f"{path}: pair {pair} is not of this study. Give what the page saved")
    return answers


def read(options):
    """Prints how often each set was chosen, with 95 % intervals over answers."""
    try:
        key = json.loads((options.output / "key.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise holdfast.Error(f"{options.output}: has no study ({error}). Make one first") from error
    counts, people = {}, len(options.read)
    for path in options.read:
        for pair, chosen in read_answers(path, key):
            a, b = key["pairs"][pair]["sets"]
            for question, value in zip(key["questions"], chosen):
                row = counts.setdefault((question, a, b), [0, 0])
                row[value] += 1
    rows, values = [], []
    for (question, a, b), (first, second) in sorted(counts.items()):
        low, high = wilson(first, first + second)
        rows.append([question, f"{a} over {b}", f"{100 * first / (first + second):.1f} %",
                     f"{100 * low:.1f} to {100 * high:.1f} %", str(first + second)])
        values.append({"question": question, "set": a, "over": b, "chosen": first, "answers": first + second,
                       "interval_95": [low, high]})
    text = _study.markdown(["question", "sets", "chosen", "95 % interval", "answers"], rows)
    _study.finish(options.output, {"participants": people, "choices": values},
                  f"{people} participants\n\n{text}")
    return 0


def main(arguments):
    parser = _study.parser("study", __doc__, "study --set ours=out/ours --set captured=out/captured -o out/study")
    parser.add_argument("--set", action="append", default=[], metavar="LABEL=FOLDER",
                        help="clips or result folders of one set; clips of a pair have the same name")
    parser.add_argument("--pairs", type=int, default=0, help="number of pairs, drawn at random; 0: all")
    parser.add_argument("--question", action="append", help=f"a question (default: {' '.join(QUESTIONS)})")
    parser.add_argument("--camera", default="follow", choices=["front", "side", "follow", "hand"],
                        help="camera of the films (holdfast.render)")
    parser.add_argument("--size", type=int, default=480, help="width and height of the films, pixels")
    parser.add_argument("--fps", type=float, default=30.0, help="frames per second of the films")
    parser.add_argument("--read", nargs="+", type=pathlib.Path, metavar="ANSWERS",
                        help="files that the page saved: prints the table of choices")
    options = parser.parse_args(arguments)
    options.question = options.question or QUESTIONS
    if options.read:
        return read(options)
    sets = {}
    for entry in options.set:
        label, equals, folder = entry.partition("=")
        if not equals or not label:
            parser.error(f"--set {entry}: expected LABEL=FOLDER")
        sets[label] = clips_of(pathlib.Path(folder))
    if len(sets) < 2:
        parser.error("give two sets or more: --set LABEL=FOLDER")
    return make(options, sets)
