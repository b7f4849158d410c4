// SPDX-License-Identifier: MIT
#include "solver/synthesis/synthesize.h"

#include <algorithm>
#include <utility>

#include <pybind11/stl.h>

#include "generator/body/rest_pelvis_note.h"
#include "generator/imos/synthesis_network.h"
#include "geometry/error.h"
#include "geometry/options.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

// SynthesisResult.
struct SynthesisAnswer {
  ClipPtr motion;
  CarriedPtr fit;
  imos::Intent intent;
  double seconds_per_key_frame = 0.0;
  std::optional<int> switch_frame;
  std::optional<double> at_face_m;
  std::vector<std::pair<int, double>> samples;  // number and fault score, best first
};
using SynthesisPtr = std::shared_ptr<SynthesisAnswer>;

// Checked arguments of one call.
struct SynthesisCall {
  SynthesisJob job;
  std::string action, weights, action_vectors;
  std::optional<ClipArgument> from;
  std::optional<int> frame;
  ModelPtr model;
  Eigen::VectorXd betas;
  LoadedObject object;
};

imos::Intent IntentOf(const SynthesisCall& call, const SynthesisNetwork& network) {
  const std::vector<std::string> names = OfferedActions(network, !call.from);
  imos::Intent intent;
  intent.action = imos::ActionId(call.action, "action",
                                 std::vector<std::string_view>(names.begin(), names.end()));
  RequireOffered(intent, names, "action");
  const std::string& told = call.job.object_class;
  const std::string& named = told.empty() ? call.object.name : told;
  const auto known = imos::FindObject(imos::VocabularyName(named));
  intent.object = known ? *known : imos::ObjectId(named, "object_class");
  return intent;
}

HoldingStart StartOf(const SynthesisCall& call, std::string_view action) {
  if (call.from) {
    return StartInClip(*call.from->clip, call.from->body, call.object, call.frame,
                       call.job.options.threads, call.from->name);
  }
  return MakeStart({call.model, call.betas}, call.object, call.object.name, action,
                   call.job.standing);
}

// Fits the object to all frames of the motion.
CarriedPtr FitMotion(const SynthesisCall& call, const SynthesizedMotion& made, const Clip& motion,
                     const StagedProgress& progress, std::vector<std::string>& notes) {
  const FitJob job = FitOf(call.job, made, call.object.name);
  LoadedClip loaded;
  loaded.clip = motion;
  loaded.body = BodyOfClip(motion.action, motion, call.model, notes);
  const auto object = std::make_shared<const PreparedObject>(
      PrepareObject(call.object, job.object_vertices, job.carry.threads));
  return Carry(job, std::move(loaded), true, object, progress, notes);
}

SynthesisPtr Run(SynthesisCall& call, const py::object& progress) {
  auto answer = std::make_shared<SynthesisAnswer>();
  std::vector<std::string> notes;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    const SynthesisNetwork network = LoadSynthesisNetwork(call.weights, call.action_vectors);
    if (const auto old = OldPelvisWarning(call.weights, network.weights.notes)) {
      notes.push_back("warning: " + *old);
    }
    answer->intent = IntentOf(call, network);
    if (const auto note = NoteOnIntent(network, answer->intent)) notes.push_back(*note);
    RequireHandheld(call.object);
    const HoldingStart start = StartOf(call, imos::Actions()[answer->intent.action].label);
    if (!go_on("synthesize", 0, 1)) throw Stopped();
    const SynthesizedMotion made = Synthesize(call.job, start, network, answer->intent, go_on);
    if (made.stopped) throw Stopped();
    answer->motion = WithSurface(made.motion, call.object.mesh);
    answer->seconds_per_key_frame = call.job.options.seconds_per_key_frame;
    answer->switch_frame = made.switch_frame;
    for (const SynthesizedSample& sample : made.samples) {
      answer->samples.emplace_back(sample.number, sample.faults);
    }
    answer->fit = FitMotion(call, made, *answer->motion, go_on, notes);
    const auto at_face = NearestToFace(start, made.motion.action, *answer->fit->clip);
    if (at_face) answer->at_face_m = at_face->distance_m;
  });
  LogNotes(notes);
  return answer;
}

SynthesisPtr SynthesizeFor(const std::string& action, const py::object& object,
                           const py::object& clip, const std::optional<int>& frame,
                           const py::object& betas, const std::string& weights,
                           const std::string& action_vectors, const py::object& body,
                           std::uint64_t seed, int threads, const py::object& progress,
                           const py::kwargs& given) {
  SynthesisCall call;
  call.action = action;
  call.weights = weights;
  call.action_vectors = action_vectors;
  call.frame = frame;
  SynthesisJob& job = call.job;
  SetOptions(given, OptionsOf(job));
  job.standing.seed = job.options.seed = seed;
  job.standing.threads = job.options.threads = ThreadsOf(threads);
  call.model = ModelOf(body);
  if (clip.is_none()) {
    if (frame) throw py::value_error("frame: needs clip");
  } else {
    if (frame && *frame < 0) throw py::value_error("frame: expected 0 or more");
    if (job.standing.in_hand || job.standing.hands != GraspHands::kRight || !betas.is_none()) {
      throw py::value_error("start, hand and betas are given by the clip: leave them out");
    }
    call.from = ClipOf(clip, body);
  }
  call.betas = Eigen::VectorXd::Zero(call.model->NumShape());
  if (!betas.is_none()) {
    const Eigen::VectorXd numbers = Vector(betas, "betas");
    if (numbers.size() > call.betas.size() ||
        (numbers.size() > 0 && numbers.cwiseAbs().maxCoeff() > kMaxBeta)) {
      throw py::value_error(fmt::format("betas: expected at most {} numbers within {:g}",
                                        call.betas.size(), kMaxBeta));
    }
    call.betas.head(numbers.size()) = numbers;
  }
  call.object = ObjectOf(object, job.object_scale);
  return Run(call, progress);
}

constexpr const char* kSynthesizeDoc =
    R"(Synthesizes body and object motion from an intent.

The object is then fitted to every frame, as in fit().

Parameters
----------
action : str
    'drink', 'pour', 'offhand', ...; the Error for another word lists all.
object : str, path or (vertices, faces)
    Mesh file, name of an embedded object, or vertices (V, 3) in meters and faces (F, 3).
clip : Clip, str or path, optional
    Continues from a frame of this clip, which shows the object in a hand. Default: a person who
    stands at the origin, facing -y.
frame : int, optional
    Frame of clip, from 0; default: the last.
betas : array_like (B,), optional
    Shape of the person, without clip.
weights : str, optional
action_vectors : str, optional
    Files of other networks.
body : BodyModel, optional
    In place of the embedded model.
seed : int, default 1
threads : int, default 0
    0: all.
progress : callable, optional
    Called with (stage, done, total); returning False stops the work.
@options

Returns
-------
SynthesisResult

Raises
------
FitFailure
    If the object cannot be held for the action.
Stopped
    If progress returns False.
Error
    For invalid input.

Examples
--------
>>> made = holdfast.synthesize('drink', 'mug')
>>> made.clip.save('drink.npz')
)";

}  // namespace

void BindSynthesize(py::module_& module) {
  py::class_<SynthesisAnswer, SynthesisPtr>(module, "SynthesisResult", "Motion from an intent.")
      .def_property_readonly(
          "clip", [](const SynthesisAnswer& self) { return self.fit->clip; },
          "Clip with the object fitted to every frame")
      .def_readonly("motion", &SynthesisAnswer::motion,
                    "Clip of the best sample before the object is fitted")
      .def_readonly("fit", &SynthesisAnswer::fit, "FitResult")
      .def_property_readonly("action",
                             [](const SynthesisAnswer& self) {
                               return std::string(imos::Actions()[self.intent.action].label);
                             })
      .def_property_readonly("object_class",
                             [](const SynthesisAnswer& self) {
                               return std::string(imos::Objects()[self.intent.object]);
                             })
      .def_property_readonly(
          "sentence", [](const SynthesisAnswer& self) { return imos::SentenceOf(self.intent); })
      .def_property_readonly(
          "samples",
          [](const SynthesisAnswer& self) {
            nlohmann::json samples = nlohmann::json::array();
            for (const auto& [number, faults] : self.samples) {
              samples.push_back({{"sample", number}, {"faults", faults}});
            }
            return ToPython(samples);
          },
          "list of dict: sample and faults, best first")
      .def_readonly("switch_frame", &SynthesisAnswer::switch_frame,
                    "frame in which the other hand takes the object, or None")
      .def_readonly("at_face_m", &SynthesisAnswer::at_face_m,
                    "minimum distance, in meters, of the rim, the phone, ... in `clip` from its "
                    "target at the lips, the ear, ...; None for actions away from the face")
      .def_readonly("seconds_per_key_frame", &SynthesisAnswer::seconds_per_key_frame)
      .def("__repr__", [](const SynthesisAnswer& self) {
        return fmt::format("<holdfast.SynthesisResult: {} ({} frames)>",
                           imos::SentenceOf(self.intent), self.fit->clip->NumFrames());
      });
  SynthesisJob job;
  module.def("synthesize", &SynthesizeFor, "action"_a, "object"_a, py::kw_only(),
             "clip"_a = py::none(), "frame"_a = py::none(), "betas"_a = py::none(),
             "weights"_a = "", "action_vectors"_a = "", "body"_a = py::none(), "seed"_a = 1,
             "threads"_a = 0, "progress"_a = py::none(),
             WithOptions(kSynthesizeDoc, OptionsOf(job)).c_str());
}

}  // namespace holdfast::python
