// SPDX-License-Identifier: MIT
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "geometry/clip/clip_body.h"
#include "geometry/error.h"
#include "geometry/render/clip_pictures.h"
#include "geometry/report/report_data.h"
#include "python/src/bindings.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/markers/marker_json.h"
#include "solver/score/score_output.h"
#include "solver/trial/trial_clip.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

}  // namespace

ReportInput SceneOf(const py::object& clip, const py::object& object, double object_scale,
                    const py::object& body, const char* name) {
  if (py::hasattr(clip, "fit") && py::hasattr(clip, "clip")) {  // SynthesisResult
    return SceneOf(clip.attr("fit"), object, object_scale, body, name);
  }
  if (py::hasattr(clip, "clip") && py::isinstance<Clip>(clip.attr("clip"))) {
    const bool own = object.is_none() && py::hasattr(clip, "object");
    ReportInput scene = SceneOf(clip.attr("clip"), own ? py::object(clip.attr("object")) : object,
                                own ? 1.0 : object_scale, body, name);
    if (py::hasattr(clip, "goals")) {  // ReachResult
      for (const py::handle goal : clip.attr("goals")) {
        scene.metrics["goals"].push_back({{"goal_m", goal["goal_m"].cast<std::vector<double>>()}});
      }
    }
    return scene;
  }
  ClipArgument argument = ClipOf(clip, body, name);
  ReportInput scene;
  scene.source = argument.name;
  scene.file = argument.file;
  scene.clip = *argument.clip;
  scene.body = argument.body.model;
  scene.betas = argument.body.betas;
  scene.made_with = scene.clip.body_model;
  scene.foreign_body =
      !scene.made_with.empty() && scene.made_with != scene.body->Name() && !scene.body->IsSubject();
  if (!object.is_none()) {
    LoadedObject loaded = ObjectOf(object, object_scale, "object");
    scene.object = std::move(loaded.mesh);
    scene.object_source = loaded.source;
  } else if (scene.clip.object) {
    ClipObject own = OwnObject(argument, object_scale);
    if (!own.warning.empty()) LogNotes({own.warning});
    scene.object = std::move(own.mesh);
    scene.object_source = own.in_clip ? argument.name : own.source;
    scene.object_missing = own.missing;
  }
  if (!scene.file.empty()) scene.metrics = MetricsBeside(scene.file);
  return scene;
}

namespace {

py::object Score(const py::object& clip, const py::object& object, const py::object& reference_clip,
                 bool per_frame, double object_scale, const py::object& body, int threads,
                 const py::object& progress, const py::kwargs& given) {
  ScoreOptions options;
  options.threads = ThreadsOf(threads);
  SetOptions(given, OptionsOf(options));
  SettleScoreOptions(options);
  const ClipScene scene = SceneOf(clip, object, object_scale, body);
  std::optional<ClipScene> reference;
  if (!reference_clip.is_none()) {
    reference = SceneOf(reference_clip, object, object_scale, body, "reference");
  }
  nlohmann::json json;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    bool going = true;
    const ClipScore score = ScoreClip(scene, reference ? &*reference : nullptr, options,
                                      [&](const char* stage, int done, int total) {
                                        going = going && go_on(stage, done, total);
                                        return going;
                                      });
    if (going) AddScores(std::span(&score, 1), options, per_frame, json);
  });
  nlohmann::json result = std::move(json["clips"][0]);
  result["definitions"] = std::move(json["protocol"]["metrics"]);
  json["protocol"].erase("metrics");
  result["protocol"].update(json["protocol"]);
  return ToPython(result);
}

// (frames, height, width, 3), or (height, width, 3) of one frame.
py::array PixelsOf(const std::vector<Image>& images, bool one) {
  const Image& first = images.front();
  std::vector<py::ssize_t> shape = {first.height, first.width, 3};
  if (!one) shape.insert(shape.begin(), std::ssize(images));
  py::array_t<std::uint8_t> pixels(shape);
  std::uint8_t* to = pixels.mutable_data();
  for (const Image& image : images) to = std::copy(image.rgb.begin(), image.rgb.end(), to);
  return pixels;
}

py::object RenderTo(const py::object& clip, const std::optional<std::filesystem::path>& path,
                    const py::object& object, double object_scale, const py::object& body,
                    const std::optional<std::filesystem::path>& markers, bool force, int threads,
                    const py::object& progress, const py::kwargs& given) {
  ClipPictureOptions how;
  SetOptions(given, OptionsOf(how));
  how.threads = ThreadsOf(threads);
  const PictureFile file = path ? PictureFileOf(*path) : PictureFile();
  const ReportInput scene = SceneOf(clip, object, object_scale, body);
  if (markers) how.how.markers = MeasuredMarkers(*markers);
  how.how.goals = GoalsIn(scene.metrics);
  const ClipPictures pictures = PlanPictures(scene.clip, file, how);
  if (!pictures.note.empty()) LogNotes({pictures.note});
  if (file.numbered) {
    for (const int number : pictures.frames) RequireNew(file.numbered->Name(number), force);
  } else if (path) {
    RequireNew(*path, force);
  } else {
    const auto [width, height] = how.size;
    RequireMemory(static_cast<double>(pictures.frames.size()) * height, width, "render");
  }
  std::vector<Image> images;
  RunWithProgress(progress, [&](const StagedProgress& watched) {
    const ClipRenderer renderer(scene.clip, scene.body, scene.betas,
                                scene.clip.object && scene.object ? &*scene.object : nullptr);
    const auto drawn = [&](int done, int total) { return watched("render", done, total); };
    if (path) {
      WritePictures(renderer, pictures, drawn);
    } else {
      images = DrawPictures(renderer, pictures, drawn);
    }
  });
  if (path) return py::none();
  return PixelsOf(images, how.frame.has_value());
}

constexpr const char* kScoreDoc =
    R"(Measures a clip as 'holdfast score' does.

Parameters
----------
clip : Clip, result, str or path
    Clip, result of fit(), refine(), grasp() or synthesize(), file, result folder, or name of an
    embedded clip.
object : str, path or (vertices, faces), optional
    Mesh in place of the clip's: mesh file, name of an embedded object, or vertices (V, 3) in meters
    and faces (F, 3).
reference : Clip, result, str or path, optional
    Clip to compare with.
per_frame : bool, default False
    Add 'per_frame' to each hand and to 'own_body'.
object_scale : float, default 1.0
    Multiplies the object's coordinates.
body : BodyModel, optional
    In place of the embedded model.
threads : int, default 0
    0: all.
progress : callable, optional
    Called with (stage, done, total); returning False stops the work.
@options

Returns
-------
dict
    'values': numbers by name ('penetration_max_mm', 'contact_frames_ratio', ...), None where
    undefined. 'hands': the same for each hand that holds. 'own_body': the frames in which the
    object ('object_in_body_worst_frame') and the arms are deepest in the person's own body.
    'definitions': the definition of each name. 'protocol': the thresholds. 'reference' and errors
    such as 'mpjpe_mm' with a reference. 'notes': remarks.

Raises
------
Stopped
    If progress returns False.
Error
    For invalid input.

Examples
--------
>>> holdfast.score(held, 'mug')['values']['penetration_max_mm']
)";

constexpr const char* kHoldTrialDoc =
    R"(Simulates with MuJoCo (libmujoco-dev) whether the hand keeps the object.

Parameters
----------
clip : Clip, result, str or path
    Clip, result of fit(), refine(), grasp() or synthesize(), file, result folder, or name of an
    embedded clip.
object : str, path or (vertices, faces), optional
    Mesh in place of the clip's, as in score().
object_scale : float, default 1.0
    Multiplies the object's coordinates.
body : BodyModel, optional
    In place of the embedded model.
friction : float, default 0.8
    Coefficient of friction of hand and object.
film : path, optional
    Video (.mp4, .gif) of the trial to write.
force : bool, default False
    Overwrite an existing file.
threads : int, default 0
    0: all.

Returns
-------
dict or None
    'held_directions' of 6, slips in mm and degrees by direction of gravity and along the clip's
    motion, and the 'protocol' (docs/metrics.md). None if in no frame exactly one hand holds an
    object.

Raises
------
Error
    Without MuJoCo, and if film exists, unless force=True.
)";

constexpr const char* kRenderDoc =
    R"(Renders a clip without GPU or display.

A .png is a sheet of pictures evenly spaced in the clip, or one picture of a frame. With %d or %03d
in the name, one picture per frame is written. A .gif or .mp4 is a video (written by the program
ffmpeg).

Parameters
----------
clip : Clip, result, str or path
    Clip, result of fit(), refine(), grasp() or synthesize(), file, result folder, or name of an
    embedded clip.
path : path, optional
    Default: return the pixels.
object : str, path or (vertices, faces), optional
    Mesh in place of the clip's, as in score().
object_scale : float, default 1.0
    Multiplies the object's coordinates.
body : BodyModel, optional
    In place of the embedded model.
markers : path, optional
    Result folder of 'holdfast solve', whose measured markers are also drawn.
force : bool, default False
    Overwrite an existing file.
threads : int, default 0
    0: all.
progress : callable, optional
    Called with (stage, done, total); returning False stops the work.
@options

Returns
-------
array of uint8 or None
    Without a path: (height, width, 3) of the given frame, or (frames, height, width, 3) of every
    'every'-th one.

Raises
------
Error
    For existing files, unless force=True.
Stopped
    If progress returns False.
)";

}  // namespace

void BindScore(py::module_& module) {
  ClipPictureOptions pictures;
  ScoreOptions usual;
  module.def("score", &Score, "clip"_a, "object"_a = py::none(), "reference"_a = py::none(),
             py::kw_only(), "per_frame"_a = false, "object_scale"_a = 1.0, "body"_a = py::none(),
             "threads"_a = 0, "progress"_a = py::none(),
             WithOptions(kScoreDoc, OptionsOf(usual)).c_str());
  module.def(
      "hold_trial",
      [](const py::object& clip, const py::object& object, double object_scale,
         const py::object& body, double friction, const std::optional<std::filesystem::path>& film,
         bool force, int threads) -> py::object {
        if (!(friction >= 0.0 && friction <= 100.0)) {
          throw py::value_error("friction: expected 0 to 100");
        }
        if (film && !VideoFormatOf(*film)) throw py::value_error("film: expected .mp4 or .gif");
        if (film) RequireNew(*film, force);
        const ClipScene scene = SceneOf(clip, object, object_scale, body);
        TrialProtocol protocol;
        protocol.scene.friction = friction;
        protocol.threads = ThreadsOf(threads);
        const std::optional<ClipTrial> trial = RunAside([scene, protocol, film] {
          std::optional<ClipTrial> tried = TryClip(scene, protocol);
          if (tried && film) WriteTrialFilm(*film, scene, *tried, protocol.threads);
          return tried;
        });
        if (!trial) return py::none();
        nlohmann::json json = TrialJson(*trial);
        json["protocol"] = TrialProtocolJson(protocol);
        return ToPython(json);
      },
      "clip"_a, "object"_a = py::none(), py::kw_only(), "object_scale"_a = 1.0,
      "body"_a = py::none(), "friction"_a = TrialProtocol{}.scene.friction, "film"_a = py::none(),
      "force"_a = false, "threads"_a = 0, kHoldTrialDoc);
  module.def("render", &RenderTo, "clip"_a, "path"_a = py::none(), py::kw_only(),
             "object"_a = py::none(), "object_scale"_a = 1.0, "body"_a = py::none(),
             "markers"_a = py::none(), "force"_a = false, "threads"_a = 0,
             "progress"_a = py::none(), WithOptions(kRenderDoc, OptionsOf(pictures)).c_str());
}

}  // namespace holdfast::python
