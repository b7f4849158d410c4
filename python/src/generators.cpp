// SPDX-License-Identifier: MIT
// Functions of the generators for holdfast.evaluate: batches of motions, and measures that need the
// body surface.
#include <algorithm>
#include <map>
#include <mutex>
#include <utility>

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "generator/imos/action_sequence.h"
#include "generator/imos/vocabulary.h"
#include "generator/matching/foot_lock.h"
#include "generator/nn/random_stream.h"
#include "generator/walk_statistics/hand_way.h"
#include "generator/walk_statistics/reach_faults.h"
#include "generator/wandr/motion_states.h"
#include "generator/wandr/network.h"
#include "generator/wandr/reach_outcome.h"
#include "generator/wandr/reach_protocol.h"
#include "generator/wandr/rollout.h"
#include "generator/wandr/walk_pace.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/parallel.h"
#include "python/src/bindings.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/body_ik/reach_refit.h"
#include "solver/latent/latent_optimizer.h"
#include "solver/latent/vae_opt.h"
#include "solver/score/metric_values.h"
#include "solver/synthesis/action_case.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

constexpr double kMotionRate = 30.0;  // Hz

// The embedded body with mean shape.
struct MeanBody {
  BodyMeasures measures = MeasureBody(*BodyModel::Default(), {});
  wandr::BoneOffsets<float> bones = wandr::BoneOffsetsOf(measures.rest_joints).Cast<float>();
  wandr::LowestPoint lowest{BodySurface(BodyModel::Default())};

  static const MeanBody& Get() {
    static const MeanBody body;
    return body;
  }
};

// Returns a network prepared to run. Networks stay in memory, since batches are small.
template <typename Ready>
std::shared_ptr<const Ready> Kept(const std::string& file) {
  static std::mutex mutex;
  static std::map<std::string, std::shared_ptr<const Ready>> kept;
  const std::lock_guard lock(mutex);
  auto& ready = kept[file];
  if (!ready) ready = std::make_shared<const Ready>(file);
  return ready;
}

struct ReadyReach {
  explicit ReadyReach(const std::string& file)
      : loaded(LoadReachNetwork(file)), network(loaded.weights) {}

  ReachNetwork loaded;
  wandr::Network<float> network;
};

py::dict ReachStartsOf(const py::object& clips, bool single_precision, const std::string& weights) {
  std::vector<Clip> moving;
  if (!clips.is_none()) {
    for (const py::handle& one : clips) moving.push_back(*ClipOf(one, py::none()).clip);
  }
  const ReadyReach& ready = *Kept<ReadyReach>(weights);
  const wandr::Normalizer<double> normalizer(ready.loaded.weights.statistics);
  std::vector<wandr::ReachStart> starts;
  if (clips.is_none()) starts = wandr::ComposedStarts(MeanBody::Get().measures, normalizer);
  for (const Clip& clip : moving) {
    starts.push_back(
        {"", wandr::StartAtFrame(wandr::StatesOfClip(clip), wandr::kReachStartFrame, normalizer)});
  }
  py::list list;
  for (const wandr::ReachStart& start : starts) {
    const wandr::StateVector<double> state = wandr::StateOf(start.start.pose);
    wandr::Pose<double> pose = start.start.pose;
    Eigen::Vector3d root = MeanBody::Get().measures.rest_joints.col(0);
    if (single_precision) {
      pose = pose.Cast<float>().Cast<double>();
      root = root.cast<float>().cast<double>();
    }
    const Eigen::Vector3d pelvis = pose.translation + root;
    const Eigen::Vector3d ahead = wandr::HeadingOf(pose.rotation[0]).Forward();
    list.append(py::dict("name"_a = start.name, "state"_a = std::vector(state.begin(), state.end()),
                         "previous_delta"_a = std::vector(start.start.previous_delta.begin(),
                                                          start.start.previous_delta.end()),
                         "pelvis"_a = std::vector(pelvis.begin(), pelvis.end()),
                         "ahead"_a = std::vector(ahead.begin(), ahead.end())));
  }
  const nlohmann::json network = {{"weights", ready.loaded.source},
                                  {"checksum", ready.loaded.checksum},
                                  {"notes", ready.loaded.weights.notes}};
  return py::dict("starts"_a = list, "network"_a = ToPython(network));
}

struct ReachBatch {
  std::vector<ReachTask> tasks;
  double sigma = 1.0;
  bool with_intention = true, refit = false;
  wandr::IntentionOptions intention;
};

std::vector<ReachSolution> SolveByIntention(const ReadyReach& ready, const ReachBatch& batch,
                                            int threads) {
  const int steps = batch.tasks[0].num_steps, latent_size = ready.network.LatentSize();
  std::vector<wandr::RolloutStart<float>> starts;
  std::vector<wandr::GoalPlan> plans;
  Eigen::MatrixXf latents(Eigen::Index{latent_size} * steps, std::ssize(batch.tasks));
  for (const ReachTask& task : batch.tasks) {
    latents.col(std::ssize(starts)) =
        wandr::DrawLatents(task.seed, task.stream, latent_size, steps, batch.sigma);
    starts.push_back(task.start);
    plans.push_back(batch.with_intention ? wandr::GoalPlan{{task.goal, task.deadline}}
                                         : wandr::GoalPlan{});
  }
  wandr::RolloutRequest request;
  request.starts = starts;
  request.plans = plans;
  request.num_steps = steps;
  request.latents = &latents;
  std::vector<ReachSolution> solutions(batch.tasks.size());
  wandr::RunRollouts(
      ready.network, MeanBody::Get().bones, request, threads, batch.intention,
      [&](int i, const wandr::RolloutTrack& track) {
        ReachSolution& solution = solutions[static_cast<std::size_t>(i)];
        solution = {track, latents.col(i), {}, {}};
        if (!batch.refit || !track.states.allFinite()) return;
        const Eigen::Vector3d& goal = batch.tasks[static_cast<std::size_t>(i)].goal;
        const wandr::ReachOutcome outcome = wandr::MeasureReach(track.joints, goal);
        const RefitGoal there{goal, outcome.closest_frame, true};
        RefitRollout(MeanBody::Get().measures, {&there, 1}, Side::kRight, solution.track);
      });
  return solutions;
}

std::vector<ReachSolution> SolveByLatents(const ReadyReach& ready, const ReachBatch& batch,
                                          int threads) {
  const BodyMeasures& measures = MeanBody::Get().measures;
  std::vector<ReachTask> tasks = batch.tasks;
  for (ReachTask& task : tasks) {
    task.deadline = std::min(task.deadline, task.num_steps);
    task.velocity = wandr::StartVelocity(ready.network, task.start);
  }
  LatentOptions options;
  options.with_intention = batch.with_intention;
  std::vector<ReachSolution> solutions = OptimizeLatents(
      ready.network, LatentBodyOf(measures.rest_joints, measures.sole_y), tasks, options, threads);
  if (!batch.refit) return solutions;
  ParallelFor(static_cast<int>(solutions.size()), threads, [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    wandr::RolloutTrack& track = solutions[at].track;
    const RefitGoal goal{tasks[at].goal, tasks[at].deadline, true};
    track.states = RefitReach(measures, track.states.cast<double>(), {&goal, 1}).cast<float>();
    track.joints = wandr::JointsOfStates(track.states, MeanBody::Get().bones);
  });
  return solutions;
}

py::list ReachMotions(const std::string& method, const py::object& states,
                      const py::object& previous_deltas, const py::object& goals,
                      const py::object& deadlines, const py::object& streams, int frames,
                      double sigma, const std::vector<std::string>& parts, bool with_intention,
                      double min_frames_left, bool hold_last_goal, double pace_m_s, bool refit,
                      const std::string& weights, std::uint64_t seed, int threads) {
  RequireBetween(frames, "frames", 2, 100'000);
  RequireBetween(sigma, "sigma", 0.0, 10.0);
  const auto start = Floats(states, "states", {-1, wandr::kStateSize});
  const py::ssize_t count = start.shape(0);
  const auto before = Floats(previous_deltas, "previous_deltas", {count, wandr::kStateSize});
  const Eigen::Matrix3Xd places = Columns(goals, "goals", count);
  const auto due = Integers(deadlines, "deadlines", {count});
  const auto stream = Integers(streams, "streams", {count});
  ReachBatch batch;
  batch.sigma = sigma;
  batch.with_intention = with_intention;
  batch.refit = refit;
  batch.intention.min_frames_left = min_frames_left;
  batch.intention.hold_last_goal = hold_last_goal;
  batch.intention.pace_m_s = pace_m_s;
  const auto has = [&](const char* part) { return std::ranges::count(parts, part) > 0; };
  batch.intention.parts = {has("wrist"), has("pelvis"), has("heading")};
  for (py::ssize_t i = 0; i < count; ++i) {
    ReachTask task;
    const auto state = Eigen::Map<const wandr::StateVector<double>>(start.data(i, 0));
    task.start.pose = wandr::PoseOf<double>(state).Cast<float>();
    task.start.previous_delta =
        Eigen::Map<const wandr::StateVector<double>>(before.data(i, 0)).cast<float>();
    task.goal = places.col(i);
    task.num_steps = frames - 1;
    task.deadline = due.at(i);
    task.seed = seed;
    task.stream = static_cast<std::uint64_t>(stream.at(i));
    batch.tasks.push_back(task);
  }
  std::vector<ReachSolution> solutions;
  std::vector<double> skating(batch.tasks.size());
  const auto optimizer = method.starts_with("vae-opt-") ? method.substr(8) : std::string();
  if (optimizer.empty()) {
    Choice<int>(method, "method", {{"intention", 0}, {"latent-opt", 1}, {"vae-opt-lm", 2}});
  }
  if (count == 0) return py::list();
  RunWithProgress(py::none(), [&, threads = ThreadsOf(threads)](const StagedProgress& go_on) {
    const ReadyReach& ready = *Kept<ReadyReach>(weights);
    if (method == "intention") {
      solutions = SolveByIntention(ready, batch, threads);
    } else if (method == "latent-opt") {
      solutions = SolveByLatents(ready, batch, threads);
    } else {
      VaeOptOptions options;
      options.method = VaeOptMethodByName(optimizer);
      options.sigma = sigma;
      options.poll = [&] {
        if (!go_on("reach", 0, 1)) throw Stopped();
      };
      solutions =
          OptimizeAsPublished(ready.network, MeanBody::Get().bones, batch.tasks, options, threads);
    }
    ParallelFor(static_cast<int>(solutions.size()), threads, [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      skating[at] =
          wandr::SkatingOfLowestVertex(MeanBody::Get().lowest, solutions[at].track.states);
    });
  });
  py::list motions;
  for (std::size_t i = 0; i < solutions.size(); ++i) {
    const ReachSolution& one = solutions[i];
    py::list solves;
    for (const LatentSolve& solve : one.solves) {
      solves.append(py::make_tuple(solve.minimizer, solve.linear_solver, solve.iterations,
                                   solve.termination));
    }
    py::array_t<float> joints = Rows(one.track.joints);
    motions.append(py::dict("states"_a = Rows(one.track.states),
                            "joints"_a = joints.reshape({-1, kNumBodyJoints, 3}),
                            "foot_skating_ratio"_a = skating[i],
                            "latents"_a = Rows(one.latents.transpose()).reshape({-1}),
                            "closest_m"_a = one.trace.closest_m, "seconds_at"_a = one.trace.seconds,
                            "solves"_a = solves));
  }
  return motions;
}

// Joint positions of all frames, (T, 22, 3).
py::array JointsArray(std::span<const BodyPlacement> placed) {
  Eigen::MatrixXd joints(3 * kNumBodyJoints, std::ssize(placed));
  for (std::size_t t = 0; t < placed.size(); ++t) {
    joints.col(static_cast<Eigen::Index>(t)) = placed[t].joints.reshaped();
  }
  return Rows(joints).reshape({-1, kNumBodyJoints, 3});
}

double SkatingOf(std::span<const BodyFrame> frames, const Eigen::Matrix3Xd& rest_joints,
                 const wandr::LowestPoint& lowest) {
  wandr::StateMatrix<float> states(wandr::kStateSize, std::ssize(frames));
  for (std::size_t t = 0; t < frames.size(); ++t) {
    wandr::Pose<double> pose;
    pose.translation = frames[t].pelvis - rest_joints.col(0);
    for (std::size_t j = 0; j < kNumBodyJoints; ++j) {
      pose.rotation[j] = frames[t].local[j].toRotationMatrix();
    }
    states.col(static_cast<Eigen::Index>(t)) = wandr::StateOf(pose).cast<float>();
  }
  return wandr::SkatingOfLowestVertex(lowest, states);
}

// Kinematics of the hand with the larger displacement, in the heading frame of the pelvis.
py::dict HandWayDict(std::span<const BodyFrame> frames, std::span<const BodyPlacement> placed) {
  Eigen::Matrix3Xd farther;
  double farthest = -1.0;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    Eigen::Matrix3Xd path = HandPath(frames, placed, side);
    const double far = (path.colwise() - path.col(0)).colwise().norm().maxCoeff();
    if (far <= farthest) continue;
    farthest = far;
    farther = std::move(path);
  }
  const HandWay way = MeasureHandWay(farther, kMotionRate, 40);
  return py::dict("hand_way_m"_a = way.length_m, "hand_way_s"_a = way.seconds,
                  "hand_peak_m_s"_a = way.peak_m_s,
                  "hand_time_to_peak_ratio"_a = way.time_to_peak_ratio,
                  "hand_straightness_ratio"_a = way.straightness_ratio,
                  "hand_submovements"_a = way.submovements,
                  "profile"_a = std::vector(way.profile.begin(), way.profile.end()));
}

py::dict WalkOf(const py::object& clip, const py::object& body, bool skating) {
  const ModelPtr model = ModelOf(body);
  const ClipArgument argument = ClipOf(clip, body);
  const Clip& moving = *argument.clip;
  const Eigen::VectorXd& betas = argument.body.betas;
  const bool is_mean = argument.body.model == model && (betas.size() == 0 || betas.isZero(0.0));
  py::dict walk;
  std::vector<BodyFrame> frames;
  std::vector<BodyPlacement> placed, on_mean;
  std::vector<Soles> soles;
  std::vector<SoleBits> contacts;
  ReachFaults faults;
  std::size_t whole = 0;
  double skates = std::numeric_limits<double>::quiet_NaN();
  {
    const py::gil_scoped_release unlocked;
    const BodyMeasures own = MeasureBody(*argument.body.model, betas);
    const BodyMeasures mean = is_mean ? own : MeasureBody(*model, {});
    frames = BodyFrames(moving.frame_rate == kMotionRate ? moving : Resample(moving, kMotionRate),
                        own.rest_joints);
    whole = frames.size();
    const auto end = std::ranges::find_if_not(frames, [](const BodyFrame& frame) {
      return frame.pelvis.allFinite() &&
             std::ranges::all_of(frame.local, [](const auto& q) { return q.coeffs().allFinite(); });
    });
    frames.erase(end, frames.end());
    placed = Place(own.rest_joints, frames);
    on_mean = Place(mean.rest_joints, frames);
    soles = SolePoints(own.rest_joints, own.sole_y).At(placed);
    contacts = FindContacts(soles, kMotionRate);
    if (!frames.empty()) faults = FindReachFaults(frames, own);
    if (skating && frames.size() > 1) {
      skates = is_mean && model == BodyModel::Default()
                   ? SkatingOf(frames, own.rest_joints, MeanBody::Get().lowest)
                   : SkatingOf(frames, own.rest_joints,
                               wandr::LowestPoint(BodySurface(argument.body.model, betas)));
    }
  }
  const auto count = static_cast<py::ssize_t>(frames.size());
  py::array_t<double> yaw(count), angles({count, py::ssize_t{kNumBodyJoints}});
  Eigen::MatrixXd points(3 * GroundProbe::kNumSoles, count);
  for (py::ssize_t t = 0; t < count; ++t) {
    const auto at = static_cast<std::size_t>(t);
    yaw.mutable_at(t) = Yaw(frames[at]);
    for (py::ssize_t j = 0; j < kNumBodyJoints; ++j) {
      angles.mutable_at(t, j) = frames[at].local[static_cast<std::size_t>(j)].angularDistance(
          Eigen::Quaterniond::Identity());
    }
    points.col(t) = soles[at].reshaped();
  }
  walk["joints"] = JointsArray(placed);
  walk["mean_joints"] = JointsArray(on_mean);
  walk["yaw"] = yaw;
  walk["angles"] = angles;
  walk["soles"] = Rows(points).reshape({-1, GroundProbe::kNumSoles, 3});
  walk["contacts"] = py::array_t<std::uint8_t>(count, contacts.data());
  walk["cut"] = whole != frames.size();
  walk["other_shape"] = is_mean && moving.betas.size() > 0 && !moving.betas.isZero(0.0);
  walk["second_crouch"] = faults.second_crouch;
  walk["lean_back_rad"] = faults.lean_back_rad;
  walk["off_balance_m"] = faults.off_balance_m;
  walk["foot_skating_ratio"] = skates;
  walk["hand"] = frames.empty() ? py::dict() : HandWayDict(frames, placed);
  return walk;
}

// ActionCase: the case, and the data it needs.
struct BoundCase {
  ActionCase one;

  // Uses the thresholds of `score`, without volumes.
  py::dict Score(const Clip& clip) const {
    ScoreOptions options;
    options.hand_object.measure_voxels = false;
    options.hand_object.measure_exact = false;
    options.exact = ExactMode::kOff;
    ClipScene scene = one.scene;
    scene.clip = clip;
    const MetricValues values = RunAside([scene, options] {
      return ClipValues(ScoreClip(scene, nullptr, options, [](auto...) { return true; }), options);
    });
    py::dict dict;
    for (const auto& [key, value] : values) dict[key.c_str()] = py::cast(value);
    return dict;
  }
};

std::unique_ptr<BoundCase> LoadCase(const std::string& path, const std::string& key_frames) {
  const auto rule = Choice<imos::KeyFrameRule>(
      key_frames, "key_frames",
      {{"whole", imos::KeyFrameRule::kWhole}, {"paper", imos::KeyFrameRule::kPaper}});
  Clip clip = ReadClip(path);
  if (imos::LackOfKeyFrames(clip, rule)) return nullptr;
  const std::filesystem::path file = path;
  if (clip.subject.empty()) clip.subject = file.parent_path().filename().string();
  auto made = std::make_unique<BoundCase>();
  try {
    made->one.sequence = imos::SequenceFromClip(clip, BodyModel::Default(), rule);
  } catch (const Error& error) {
    throw Error(fmt::format("{} ({})", path, error.Where()), error.Problem(), error.Remedy());
  }
  made->one.sequence.name = file.stem().string();
  made->one.sequence.source = path;
  ClipScene& scene = made->one.scene;
  // Loaded from its file, by which fits find the mesh, instead of with the mesh in the clip.
  LoadedClip loaded = LoadClip(path);
  ClipObject own = FindClipObject(loaded);
  scene.source = path;
  scene.clip = std::move(loaded.clip);
  scene.body = loaded.body.model;
  scene.betas = loaded.body.betas;
  scene.object = std::move(own.mesh);
  scene.object_source = own.in_clip ? path : own.source;
  scene.object_missing = own.missing;
  if (!scene.object)
    throw Error(path, scene.object_missing, "Put the mesh at the path in the clip");
  made->one.keys = imos::KeyFramesOf(scene.clip, rule);
  return made;
}

py::dict Generate(const BoundCase& self, const std::string& objects, const std::string& weights,
                  std::uint64_t stream, std::uint64_t stroke_seed, double sigma, bool finish,
                  std::uint64_t seed) {
  CaseOptions options;
  options.mode = Choice<ObjectMode>(objects, "objects",
                                    {{"given", ObjectMode::kGiven},
                                     {"carried", ObjectMode::kCarried},
                                     {"fitted", ObjectMode::kFitted}});
  RequireBetween(sigma, "sigma", 0.0, 3.0);
  options.stream = stream;
  options.stroke_seed = stroke_seed;
  options.sigma = sigma;
  options.finish = finish;
  options.seed = seed;
  static FitLibrary library(64);
  const MadeCase made = RunAside([one = self.one, options, weights] {
    return MakeCase(*Kept<CaseNetwork>(weights), one, options, library);
  });
  py::dict dict;
  dict["keys"] = std::make_shared<Clip>(made.keys);
  dict["clip"] = made.finished ? py::cast(std::make_shared<Clip>(*made.finished)) : py::none();
  dict["seconds"] = made.seconds;
  dict["finishing_seconds"] = made.finishing_seconds;
  return dict;
}

void BindActionCase(py::module_& module) {
  py::class_<BoundCase>(
      module, "ActionCase",
      "An action with an object in the form of IMoS's networks (Ghosh et al. 2023).\n"
      "\n"
      "Has 15 key frames of a clip, of which the first four are given. Created by action_case().")
      .def("__repr__",
           [](const BoundCase& self) {
             return fmt::format("<holdfast.ActionCase: {}>", self.one.sequence.name);
           })
      .def_property_readonly("subject",
                             [](const BoundCase& self) { return self.one.sequence.subject; })
      .def_property_readonly("name", [](const BoundCase& self) { return self.one.sequence.name; })
      .def_property_readonly(
          "action_id", [](const BoundCase& self) { return self.one.sequence.action; },
          "number of the action among the 29 of the vocabulary")
      .def_property_readonly("action",
                             [](const BoundCase& self) {
                               return std::string(imos::Actions()[self.one.sequence.action].label);
                             })
      .def_property_readonly(
          "clip", [](const BoundCase& self) { return std::make_shared<Clip>(self.one.scene.clip); },
          "Clip, all of its frames; a copy")
      .def_property_readonly(
          "keys", [](const BoundCase& self) { return std::make_shared<Clip>(self.one.keys); },
          "Clip of the 15 key frames; a copy")
      .def(
          "joints",
          [](const BoundCase& self, const Clip& keys) {
            return Rows(JointsOf(keys, self.one)).reshape({-1, kNumBodyJoints, 3});
          },
          "keys"_a,
          R"(Returns the joints of key frames.

Parameters
----------
keys : Clip

Returns
-------
array (T, 22, 3)
    Meters, in the frame in which the first key frame of this case stands at the origin and faces
    -y.
)")
      .def(
          "object_from_head",
          [](const BoundCase& self, const Clip& keys) {
            return Rows(ObjectFromHead(keys, self.one));
          },
          "keys"_a, R"(Returns the object's translation in the frame of the head joint.

Parameters
----------
keys : Clip

Returns
-------
array (T, 3)
    Meters.
)")
      .def(
          "in_motion",
          [](const BoundCase&, const Clip& keys, double frame_rate) {
            RequirePositive(frame_rate, "frame_rate");
            return std::make_shared<Clip>(ResampleSmoothly(keys, frame_rate));
          },
          "keys"_a, "frame_rate"_a = kMotionRate,
          R"(Interpolates key frames by curves.

Parameters
----------
keys : Clip
frame_rate : float, default 30.0
    Hz.

Returns
-------
Clip
)")
      .def("score", &BoundCase::Score, "clip"_a,
           R"(Measures a clip with this case's object, without volumes.

Parameters
----------
clip : Clip

Returns
-------
dict
    'values' of holdfast.score().
)")
      .def("generate", &Generate, "objects"_a, py::kw_only(), "weights"_a = "", "stream"_a = 0,
           "stroke_seed"_a = 1, "sigma"_a = 1.0, "finish"_a = false, "seed"_a = 1,
           R"(Generates the motion after the four given key frames with a network.

Parameters
----------
objects : {'given', 'carried', 'fitted'}
    'given': ground truth. 'carried': fixed to the wrist. 'fitted': the loop of synthesize().
weights : str, optional
    File of another network.
stream : int, default 0
    Stream of the seed that latents are drawn from.
stroke_seed : int, default 1
    Seed of strokes added to the motion.
sigma : float, default 1.0
    Standard deviation of the latents.
finish : bool, default False
    With objects='fitted': also fit all frames.
seed : int, default 1

Returns
-------
dict
    'keys': a Clip of 15. 'clip': all frames fitted (objects='fitted' with finish). 'seconds' and
    'finishing_seconds' of one core.
)");
  module.def("action_case", &LoadCase, "path"_a, py::kw_only(), "key_frames"_a = "whole",
             R"(Reads an action from a clip's file.

Parameters
----------
path : str
key_frames : {'whole', 'paper'}, default 'whole'
    'whole' spreads the key frames over the clip, 'paper' over the contact, as published.

Returns
-------
ActionCase or None
    None for a clip too short for 15 key frames.

Raises
------
Error
    For a clip without object, and for an action or object that is not in the vocabulary.
)");
  module.def(
      "synthesis_network",
      [](const std::string& weights) {
        const SynthesisNetwork& network = Kept<CaseNetwork>(weights)->loaded;
        nlohmann::json json = network.ToJson();
        json["config"] = imos::ConfigTexts(network.weights.config);
        return ToPython(json);
      },
      "weights"_a = "",
      R"(Describes a network of ActionCase.generate().

Parameters
----------
weights : str, optional
    File of another network.

Returns
-------
dict
    'weights', 'checksum', 'notes' and 'config'.
)");
}

constexpr const char* kReachMotionsDoc =
    R"(Generates N motions of the embedded body to goals of the right wrist.

As evaluated by WANDR's protocol (Diomataris et al. 2024), at 30 Hz. Results do not depend on the
rest of the batch. with_intention, parts, min_frames_left, hold_last_goal and pace_m_s select what
the network gets of the goal.

Parameters
----------
method : str
    'intention', 'latent-opt', 'vae-opt-lm', 'vae-opt-lbfgs', 'vae-opt-lbfgs-step1' or
    'vae-opt-adam'.
states : array_like (N, 135)
previous_deltas : array_like (N, 135)
    Start states, as of reach_starts().
goals : array_like (N, 3)
    Meters.
deadlines : array_like (N,) of int
    Frames from the start.
streams : array_like (N,) of int
    Streams of the seed that latents are drawn from.
frames : int, default 240
    Frames of each motion.
sigma : float, default 1.0
    Standard deviation of the latents.
parts : list of {'wrist', 'pelvis', 'heading'}, default ['wrist', 'pelvis', 'heading']
with_intention : bool, default True
min_frames_left : float, default 1.0
hold_last_goal : bool, default False
pace_m_s : float, default 0.0
    0: off.
refit : bool, default False
    Pin planted feet and place the wrist.
weights : str, optional
    File of another network.
seed : int, default 1
threads : int, default 1
    0: all.

Returns
-------
list of dict
    For each motion: 'states' (T, 135), 'joints' (T, 22, 3), 'foot_skating_ratio' (fraction of
    frames whose lowest vertex moves by more than 2/3 cm), 'latents', 'closest_m' and 'seconds_at'
    of each iterate, and 'solves': (minimizer, linear solver, iterations, termination).
)";

constexpr const char* kReachStartsDoc =
    R"(Returns where motions of WANDR's protocol start, and the network.

Parameters
----------
clips : list of Clip, str or path, optional
    Starts are frame 25 at 30 Hz of each clip. Default: six composed poses.
single_precision : bool, default True
    'pelvis' and 'ahead' in the network's precision.
weights : str, optional
    File of another network.

Returns
-------
dict
    'starts': list of dict with 'name', 'state' and 'previous_delta' (135 numbers each), 'pelvis' (3
    numbers, meters) and 'ahead' (3 numbers, the heading). 'network': dict of 'weights', 'checksum',
    'notes'.
)";

constexpr const char* kWalkDoc =
    R"(Measures a clip's body at 30 Hz with its feet.

Parameters
----------
clip : Clip, str or path
    Clip, file, result folder, or name of an embedded clip.
body : BodyModel, optional
    In place of the embedded model.
skating : bool, default False
    Compute 'foot_skating_ratio'.

Returns
-------
dict
    - 'joints' (T, 22, 3), in meters.
    - 'mean_joints' (T, 22, 3), the same on the mean shape.
    - 'yaw' (T,) of the pelvis in radians; 0 faces -y.
    - 'angles' (T, 22) of joints from the rest pose in radians.
    - 'soles' (T, 4, 3): left heel, left ball, right heel, right ball.
    - 'contacts' (T,): bit i where sole i is on the ground (below 4 cm, slower than 0.35 m/s).
    - 'cut': whether frames from the first non-finite one on are left out.
    - 'other_shape': whether the clip's betas are of another model.
    - 'second_crouch': frame in which the person crouches a second time on the way, or -1.
    - 'lean_back_rad': maximum lean backwards while waiting.
    - 'off_balance_m': how far the center of mass is outside of the feet in the last frame, NaN if
      the person moves there.
    - 'hand': path of the hand that moves farthest (speed, straightness).
    - 'foot_skating_ratio', as of reach_motions(); NaN without skating=True.
)";

}  // namespace

void BindGenerators(py::module_& module) {
  module.def("reach_starts", &ReachStartsOf, "clips"_a = py::none(), py::kw_only(),
             "single_precision"_a = true, "weights"_a = "", kReachStartsDoc);
  module.def("reach_motions", &ReachMotions, "method"_a, "states"_a, "previous_deltas"_a, "goals"_a,
             "deadlines"_a, "streams"_a, py::kw_only(), "frames"_a = 240, "sigma"_a = 1.0,
             "parts"_a = std::vector<std::string>{"wrist", "pelvis", "heading"},
             "with_intention"_a = true, "min_frames_left"_a = 1.0, "hold_last_goal"_a = false,
             "pace_m_s"_a = 0.0, "refit"_a = false, "weights"_a = "", "seed"_a = 1, "threads"_a = 1,
             kReachMotionsDoc);
  module.def("walk", &WalkOf, "clip"_a, py::kw_only(), "body"_a = py::none(), "skating"_a = false,
             kWalkDoc);
  module.def(
      "random_draws",
      [](std::uint64_t seed, py::ssize_t count) {
        RequireMemory(static_cast<double>(count), 1.0, "count");
        py::array_t<double> draws(count);
        RandomDraws random(seed);
        for (py::ssize_t i = 0; i < count; ++i) draws.mutable_data()[i] = random.Uniform(0.0, 1.0);
        return draws;
      },
      "seed"_a, "count"_a,
      R"(Draws numbers of [0, 1) by the 64-bit Mersenne Twister: the same on every machine.

Parameters
----------
seed : int
count : int

Returns
-------
array (count,)
)");
  BindActionCase(module);
}

}  // namespace holdfast::python
