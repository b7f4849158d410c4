// SPDX-License-Identifier: MIT
#include <mutex>
#include <utility>

#include <pybind11/stl.h>

#include "generator/body/rest_pelvis_note.h"
#include "generator/wandr/motion_states.h"
#include "generator/wandr/network.h"
#include "geometry/rotation.h"
#include "python/src/bindings.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/reach/goal_follower.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

// GoalFollower: one motion, which grows by one frame per call.
class Follower {
 public:
  Follower(ReachPerson person, const wandr::NetworkWeights& network, const FollowOptions& options)
      : person_(std::move(person)), follower_(person_, network, options) {
    states_.push_back(person_.states.rightCols<1>());
  }

  // Returns (55, 3) axis-angles and (3,) trans.
  py::tuple Step(const py::object& goal) {
    const py::array_t<double> numbers = Floats(goal, "goal", {3});
    const Eigen::Vector3d at = Eigen::Map<const Eigen::Vector3d>(numbers.data());
    wandr::Pose<double> pose;
    {
      const py::gil_scoped_release release;
      const std::lock_guard lock(mutex_);
      pose = follower_.Step(at);
      states_.push_back(wandr::StateOf(pose));
    }
    JointPose rotations = JointPose::Zero();
    for (int k = 0; k < kNumBodyJoints; ++k) {
      rotations.col(k) = LogSO3(pose.rotation[static_cast<std::size_t>(k)]);
    }
    return py::make_tuple(Rows(rotations),
                          py::array_t<double>(py::ssize_t{3}, pose.translation.data()));
  }

  void Push(const py::object& by) {
    const py::array_t<double> numbers = Floats(by, "by", {3});
    const std::lock_guard lock(mutex_);
    follower_.Push(Eigen::Map<const Eigen::Vector3d>(numbers.data()));
  }

  ClipPtr Motion() {
    const std::lock_guard lock(mutex_);
    wandr::StateMatrix<double> states(wandr::kStateSize, static_cast<Eigen::Index>(states_.size()));
    for (std::size_t t = 0; t < states_.size(); ++t) {
      states.col(static_cast<Eigen::Index>(t)) = states_[t];
    }
    auto clip = std::make_shared<Clip>(wandr::ClipOfStates(states, person_.like));
    clip->action = "reach";
    return clip;
  }

 private:
  ReachPerson person_;
  GoalFollower follower_;
  std::vector<wandr::StateVector<double>> states_;
  std::mutex mutex_;
};

std::unique_ptr<Follower> MakeFollower(const py::object& clip, const std::optional<int>& frame,
                                       const std::string& wrist, int candidates, int horizon,
                                       double sigma, const std::string& weights,
                                       const py::object& body, std::uint64_t seed) {
  FollowOptions options;
  options.side = Choice<Side>(wrist, "wrist", {{"right", Side::kRight}, {"left", Side::kLeft}});
  RequireBetween(candidates, "candidates", 1, 1'000);
  RequireBetween(horizon, "horizon", 1, 120);
  RequireBetween(sigma, "sigma", 0.0, 3.0);
  options.candidates = candidates;
  options.horizon = horizon;
  options.sigma = sigma;
  options.seed = seed;
  if (clip.is_none() && frame) throw py::value_error("frame: needs clip");
  const ModelPtr model = ModelOf(body);
  std::optional<ClipArgument> start;
  if (!clip.is_none()) start = ClipOf(clip, body);
  const ReachNetwork network = RunAside([weights] { return LoadReachNetwork(weights); });
  if (const auto old = OldPelvisWarning(weights, network.weights.notes)) {
    LogNotes({"warning: " + *old});
  }
  const py::gil_scoped_release release;
  ReachPerson person =
      start ? PersonInClip(*start->clip, start->body, frame, start->name) : StandingPerson(model);
  return std::make_unique<Follower>(std::move(person), network.weights, options);
}

}  // namespace

void BindFollow(py::module_& module) {
  py::class_<Follower>(module, "GoalFollower",
                       R"(A person whose wrist follows a moving goal, frame by frame at 30 Hz.

Each pose depends only on the current goal and earlier ones.

Parameters
----------
clip : Clip, str or path, optional
    Continues from a frame of this clip. Default: a person standing at the origin, facing -y.
frame : int, optional
    Frame of clip; default: the last.
wrist : {'right', 'left'}, default 'right'
candidates : int, default 48
    Number of motions tried in every frame.
horizon : int, default 14
    Their length in frames.
sigma : float, default 0.7
    Standard deviation of the latents.
weights : str, optional
    File of another network.
body : BodyModel, optional
    In place of the embedded model.
seed : int, default 1

Examples
--------
>>> follower = holdfast.GoalFollower()
>>> pose, trans = follower.step((0.5, -0.6, 1.1))
)")
      .def(py::init(&MakeFollower), py::kw_only(), "clip"_a = py::none(), "frame"_a = py::none(),
           "wrist"_a = "right", "candidates"_a = FollowOptions().candidates,
           "horizon"_a = FollowOptions().horizon, "sigma"_a = FollowOptions().sigma,
           "weights"_a = "", "body"_a = py::none(), "seed"_a = 1)
      .def("step", &Follower::Step, "goal"_a,
           R"(Returns the pose 1/30 s later.

Parameters
----------
goal : array_like (3,)
    Current goal of the wrist, world, meters, z up.

Returns
-------
pose : array (55, 3)
    Axis-angle, radians.
trans : array (3,)
    Meters.

Raises
------
Error
    For a goal below the ground or more than 20 m away.
)")
      .def("push", &Follower::Push, "by"_a,
           R"(Pushes the body over the next 0.3 s.

Parameters
----------
by : array_like (3,)
    Displacement, world, meters; at most 1 m.
)")
      .def_property_readonly("clip", &Follower::Motion,
                             "Clip at 30 Hz: where it started, and a frame for each step; a copy")
      .def("__repr__", [](Follower& self) {
        return fmt::format("<holdfast.GoalFollower: {} frames>", self.Motion()->NumFrames());
      });
}

}  // namespace holdfast::python
