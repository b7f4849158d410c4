// SPDX-License-Identifier: MIT
#include "solver/synthesis/synthesize.h"

#include <algorithm>
#include <utility>

#include <fmt/ranges.h>
#include <pybind11/stl.h>

#include "generator/actions/action_catalog.h"
#include "generator/body/rest_pelvis_note.h"
#include "generator/imos/config.h"
#include "generator/imos/synthesis_network.h"
#include "geometry/error.h"
#include "geometry/value_ranges.h"
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
  std::vector<std::pair<int, double>> samples;  // number and faults, best first
};
using SynthesisPtr = std::shared_ptr<SynthesisAnswer>;

// One call, checked.
struct SynthesisCall {
  std::string action, object_class, weights, action_embeddings;
  std::optional<ClipArgument> from;
  std::optional<int> frame;
  ModelPtr model;
  Eigen::VectorXd betas;
  LoadedObject object;
  std::optional<double> seconds;
  StandingHoldOptions standing;
  SynthesizeOptions options;
};

// Actions that the networks know and, where a start is to be made, that one can be made for.
imos::Intent IntentOf(const SynthesisCall& call, const SynthesisNetwork& network) {
  std::vector<std::string> names = network.Actions();
  std::erase_if(names, [&](const std::string& name) {
    return !call.from &&
           std::ranges::find(MadeActions(), name, &MadeAction::name) == MadeActions().end();
  });
  const std::vector<std::string_view> offered(names.begin(), names.end());
  imos::Intent intent;
  intent.action = imos::ActionId(call.action, "action", offered);
  const std::string_view label = imos::Actions()[intent.action].label;
  if (std::ranges::find(offered, label) == offered.end()) {
    throw Error("action", fmt::format("no motion can be generated for '{}'", label),
                fmt::format("There are: {}", fmt::join(offered, ", ")));
  }
  const std::string& named = call.object_class.empty() ? call.object.name : call.object_class;
  const auto known = imos::FindObject(imos::VocabularyName(named));
  intent.object = known ? *known : imos::ObjectId(named, "object_class");
  return intent;
}

HoldingStart StartOf(const SynthesisCall& call, std::string_view action) {
  if (call.from) {
    return StartInClip(*call.from->clip, call.from->body, call.object, call.frame,
                       call.options.threads, call.from->name);
  }
  StandingHold hold =
      MakeStandingHold({call.model, call.betas}, call.object, action, call.standing);
  if (hold.status == StandingHoldStatus::kNoGrasp) {
    throw FitFailure(fmt::format("{}: {}. Try another size (--object-scale)", call.object.name,
                              Describe(hold.grasp)));
  }
  if (hold.status == StandingHoldStatus::kNobodyCan) {
    throw FitFailure(
        fmt::format("{}: nobody can hold it so as to '{}': {} ({}). Try another --seed, "
                    "--betas or --object-scale",
                    call.object.name, action, hold.fault, hold.detail));
  }
  return std::move(hold.start);
}

// A note where the networks have seen the action, and never with the object.
void NoteOnIntent(const SynthesisNetwork& network, const imos::Intent& intent,
                  std::vector<std::string>& notes) {
  const std::string object(imos::Objects()[intent.object]);
  const auto seen = network.seen.find(std::string(imos::Actions()[intent.action].label));
  if (seen == network.seen.end() || !seen->second.is_object() || seen->second.contains(object)) {
    return;
  }
  std::vector<std::string> objects;
  for (const auto& [name, count] : seen->second.items()) objects.push_back(name);
  notes.push_back(fmt::format("nobody was seen who {} a {}; seen with {}",
                              imos::Actions()[intent.action].verb, object,
                              fmt::join(objects, ", ")));
}

// The object fitted to all frames of the motion.
CarriedPtr FitMotion(const SynthesisCall& call, const SynthesizedMotion& made, const Clip& motion,
                     const StagedProgress& progress, std::vector<std::string>& notes) {
  FitJob job;
  job.clip = motion.action;
  job.object = call.object.name;
  LoadedClip loaded;
  loaded.clip = motion;
  loaded.body = BodyOfClip(motion.action, motion, call.model, notes);
  CarryOptions& carry = job.carry;
  carry.clear_passages = made.lets_go;
  carry.hand_over = made.switch_frame.has_value();
  if (carry.hand_over) {
    carry.handover.switch_frames = {*made.switch_frame};
    carry.handover.first_hand = made.first_hand;
  }
  carry.seed = call.options.seed;
  carry.threads = call.options.threads;
  const auto object = std::make_shared<const PreparedObject>(
      PrepareObject(call.object, job.object_vertices, carry.threads));
  return Carry(job, std::move(loaded), true, object, progress, notes);
}

SynthesisPtr Run(SynthesisCall& call, const py::object& progress) {
  auto answer = std::make_shared<SynthesisAnswer>();
  std::vector<std::string> notes;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    const SynthesisNetwork network = LoadSynthesisNetwork(call.weights, call.action_embeddings);
    if (const auto old = OldPelvisWarning(call.weights, network.weights.notes)) {
      notes.push_back("warning: " + *old);
    }
    answer->intent = IntentOf(call, network);
    NoteOnIntent(network, answer->intent, notes);
    RequireHandheld(call.object);
    const HoldingStart start = StartOf(call, imos::Actions()[answer->intent.action].label);
    if (!go_on("synthesize", 0, 1)) throw Stopped();
    SynthesizeOptions& options = call.options;
    options.seconds_per_key_frame = call.seconds
                                        ? *call.seconds / (options.key_frames - 1)
                                        : network.SecondsPerKeyFrame(answer->intent.action);
    options.action_table = network.action_table;
    const SynthesizedMotion made =
        Synthesize(start, network.weights, answer->intent, options, go_on);
    if (made.stopped) throw Stopped();
    answer->motion = WithSurface(made.motion, call.object.mesh);
    answer->seconds_per_key_frame = options.seconds_per_key_frame;
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
                           const std::string& object_class, const py::object& clip,
                           const std::optional<int>& frame, const std::string& start,
                           const std::string& hand, const py::object& betas, int samples,
                           const std::optional<double>& seconds, int key_frames, double sigma,
                           double frame_rate, bool and_back, double object_scale,
                           const std::string& weights, const std::string& action_embeddings,
                           const py::object& body, std::uint64_t seed, int threads,
                           const py::object& progress) {
  SynthesisCall call{action, object_class, weights, action_embeddings, {}, frame,
                     {},     {},           {},      seconds,           {}, {}};
  RequireBetween(samples, "samples", 1, 10'000);
  RequireBetween(key_frames, "key_frames", imos::kHistory + 1, 1000);
  RequireBetween(sigma, "sigma", 0.0, 3.0);
  RequireBetween(frame_rate, "frame_rate", 5.0, 240.0);
  if (seconds) RequireBetween(*seconds, "seconds", 0.5, 60.0);
  RequirePositive(object_scale, "object_scale");
  call.standing.in_hand = Choice<std::optional<bool>>(
      start, "start", {{"any", std::nullopt}, {"table", false}, {"hand", true}});
  call.standing.left = Choice<bool>(hand, "hand", {{"right", false}, {"left", true}});
  call.standing.seed = call.options.seed = seed;
  call.standing.threads = call.options.threads = ThreadsOf(threads);
  call.options.samples = samples;
  call.options.key_frames = key_frames;
  call.options.sigma = sigma;
  call.options.frame_rate = frame_rate;
  call.options.and_back = and_back;
  call.model = ModelOf(body);
  if (clip.is_none()) {
    if (frame) throw py::value_error("frame: needs clip");
  } else {
    if (frame && *frame < 0) throw py::value_error("frame: expected 0 or more");
    if (start != "any" || hand != "right" || !betas.is_none()) {
      throw py::value_error("start, hand and betas are the clip's: leave them out");
    }
    call.from = ClipOf(clip, body);
  }
  call.betas = Eigen::VectorXd::Zero(call.model->NumShape());
  if (!betas.is_none()) {
    const Eigen::VectorXd given = Vector(betas, "betas");
    if (given.size() > call.betas.size() ||
        (given.size() > 0 && given.cwiseAbs().maxCoeff() > kMostBeta)) {
      throw py::value_error(fmt::format("betas: expected at most {} numbers within {:g}",
                                        call.betas.size(), kMostBeta));
    }
    call.betas.head(given.size()) = given;
  }
  call.object = ObjectOf(object, object_scale);
  return Run(call, progress);
}

constexpr const char* kSynthesizeDoc = R"(A person does something with an object: body and object
motion from an intent, then the object fitted to every frame (fit()).

action: 'drink', 'pour', 'offhand', ...; Error lists all. object as for fit(); object_class: what it
is to the networks ('mug', 'waterbottle', ...), '' for its name.

clip: continues from this Clip, path or embedded clip, which shows the object in a hand at `frame`
(from 0; None: the last). None: a person who stands at the origin, facing -y, with `betas` (B,) and
the object in `hand` ('right', 'left'); start: 'table', 'hand' or 'any'.

samples: motions to choose from. seconds: duration (None: the usual one of the action). key_frames:
with the four given ones. sigma of the latents, 0: the mean motion. frame_rate in Hz. and_back: the object
goes back to where it was, and the hand lets go of it where that is a table. weights,
action_embeddings: files of other networks.

Returns SynthesisResult. Raises FitFailure where the object cannot be held so, Stopped, and Error.

    made = holdfast.synthesize('drink', 'mug')
    made.clip.save('drink.npz'))";

}  // namespace

void BindSynthesize(py::module_& module) {
  py::class_<SynthesisAnswer, SynthesisPtr>(module, "SynthesisResult", "Motion from an intent.")
      .def_property_readonly(
          "clip", [](const SynthesisAnswer& self) { return self.fit->clip; },
          "Clip with the object fitted to every frame")
      .def_readonly("motion", &SynthesisAnswer::motion, "Clip of the best sample before that")
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
                    "frame in which the other hand takes the object over, or None")
      .def_readonly(
          "at_face_m", &SynthesisAnswer::at_face_m,
          "metres that the rim, the phone ... of `clip` stays from its place at the lips, "
          "the ear ... where it is nearest; None for actions away from the face")
      .def_readonly("seconds_per_key_frame", &SynthesisAnswer::seconds_per_key_frame)
      .def("__repr__", [](const SynthesisAnswer& self) {
        return fmt::format("<holdfast.SynthesisResult: {} ({} frames)>",
                           imos::SentenceOf(self.intent), self.fit->clip->NumFrames());
      });
  module.def("synthesize", &SynthesizeFor, "action"_a, "object"_a, py::kw_only(),
             "object_class"_a = "", "clip"_a = py::none(), "frame"_a = py::none(),
             "start"_a = "any", "hand"_a = "right", "betas"_a = py::none(), "samples"_a = 8,
             "seconds"_a = py::none(), "key_frames"_a = imos::kNumKeyFrames, "sigma"_a = 1.0,
             "frame_rate"_a = 30.0, "and_back"_a = false, "object_scale"_a = 1.0, "weights"_a = "",
             "action_embeddings"_a = "", "body"_a = py::none(), "seed"_a = 1, "threads"_a = 0,
             "progress"_a = py::none(), kSynthesizeDoc);
}

}  // namespace holdfast::python
