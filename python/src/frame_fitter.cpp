// SPDX-License-Identifier: MIT
#include <array>
#include <mutex>
#include <span>
#include <utility>

#include "geometry/rotation.h"
#include "geometry/value_ranges.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/fit/frame_fitter.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

// One frame as it was solved.
struct LiveFrame {
  ObjectPose object;
  FingerPose fingers;
};

// FrameFitter with all that it looks at; its calls wait for each other.
class LiveFitter {
 public:
  LiveFitter(LoadedObject object, int vertices, const ClipBody& body, Side side,
             const FitOptions& options, double frame_s)
      : side_(side),
        object_(PrepareObject(std::move(object), vertices, options.threads)),
        hand_(body.model, body.betas, side),
        fitter_(std::array<const HandModel*, 1>{&hand_}, object_.fit, options, frame_s) {}

  LiveFrame Start(const JointPose& pose, const Eigen::Vector3d& trans, const ObjectPose& object) {
    const std::scoped_lock guard(lock_);
    fitter_.Release(side_);
    fitter_.Place(object);
    fitter_.Grip(side_, pose, trans, FingersOf(pose, side_));
    fitter_.Settle(side_, pose, trans, true);
    holds_ = true;
    report_ = fitter_.FirstFrame();
    contact_pairs_ = fitter_.NumContactPairs();
    body_ = fitter_.Body();
    return {fitter_.Object(), fitter_.Fingers()};
  }

  LiveFrame Step(const JointPose& pose, const Eigen::Vector3d& trans) {
    const std::scoped_lock guard(lock_);
    if (!holds_)
      throw std::runtime_error("FrameFitter.step: the hand does not hold: start() first");
    report_ = fitter_.Solve(pose, trans);
    body_ = fitter_.Body();
    return {fitter_.Object(), fitter_.Fingers()};
  }

  // What the last frame came to.
  struct Account {
    FrameReport report;
    JointPose body = JointPose::Zero();
    int contact_pairs = 0;
  };
  Account Last() {
    const std::scoped_lock guard(lock_);
    return {report_, body_, contact_pairs_};
  }
  Side HandSide() const { return side_; }
  const PreparedObject& Object() const { return object_; }

 private:
  std::mutex lock_;
  Side side_;
  PreparedObject object_;
  HandModel hand_;
  FrameFitter fitter_;
  bool holds_ = false;
  FrameReport report_;
  JointPose body_ = JointPose::Zero();
  int contact_pairs_ = 0;
};

Eigen::Vector3d PointOf(const py::object& value, const char* name) {
  const Eigen::Vector3d point = Eigen::Map<const Eigen::Vector3d>(Floats(value, name, {3}).data());
  if (point.cwiseAbs().maxCoeff() > kMostMetres) {
    throw py::value_error(fmt::format("{}: {}", name, kMetresRemedy));
  }
  return point;
}

JointPose PoseOf(const py::object& value) {
  const bool by_joint = py::hasattr(value, "ndim") && value.attr("ndim").cast<int>() == 2;
  const py::array_t<double> numbers =
      by_joint ? Floats(value, "poses", {kNumJoints, 3}) : Floats(value, "poses", {3 * kNumJoints});
  const JointPose pose = Eigen::Map<const JointPose>(numbers.data());
  if (pose.cwiseAbs().maxCoeff() > kMostRadians) {
    throw py::value_error(fmt::format("poses: {}", kRadiansRemedy));
  }
  return pose;
}

// (3, 3), or axis-angle (3,).
Eigen::Quaterniond RotationOf(const py::object& value, const char* name) {
  const py::array any = py::array::ensure(value);
  if (any && any.ndim() == 1) {
    const Eigen::Vector3d turn = Eigen::Map<const Eigen::Vector3d>(Floats(value, name, {3}).data());
    if (turn.cwiseAbs().maxCoeff() > kMostRadians) {
      throw py::value_error(fmt::format("{}: {}", name, kRadiansRemedy));
    }
    return Eigen::Quaterniond(ExpSO3(turn));
  }
  PyErr_Clear();
  const py::array_t<double> numbers = Floats(value, name, {3, 3});
  const Eigen::Matrix3d rotation =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers.data());
  if (!(rotation * rotation.transpose()).isIdentity(1e-3) || rotation.determinant() < 0.0) {
    throw py::value_error(fmt::format(
        "{}: expected a rotation: R R^T is not the identity to 0.001, or a reflection", name));
  }
  return Eigen::Quaterniond(rotation).normalized();
}

py::tuple TupleOf(const LiveFrame& frame) {
  const Eigen::Matrix3d rotation = frame.object.orientation.toRotationMatrix();
  return py::make_tuple(Rows(rotation.transpose()),
                        py::array_t<double>(3, frame.object.translation.data()),
                        py::array_t<double>(frame.fingers.size(), frame.fingers.data()));
}

std::shared_ptr<LiveFitter> MakeFitter(const py::object& object, const std::string& hand,
                                       const py::object& weights, double contact_threshold_mm,
                                       bool slip, const py::object& body, const py::object& betas,
                                       double frame_rate, double object_scale, int object_vertices,
                                       int threads) {
  const Side side = Choice<Side>(hand, "hand", {{"right", Side::kRight}, {"left", Side::kLeft}});
  FitOptions options;
  SetWeights(weights, options);
  RequirePositive(contact_threshold_mm, "contact_threshold_mm");
  RequirePositive(object_scale, "object_scale");
  RequireBetween(frame_rate, "frame_rate", kLowestFrameRate, kHighestFrameRate);
  RequireBetween(object_vertices, "object_vertices", 4, 100'000);
  options.contact_threshold_m = 1e-3 * contact_threshold_mm;
  options.slip = slip;
  options.threads = ThreadsOf(threads);
  ClipBody person{ModelOf(body), {}};
  if (!betas.is_none()) person.betas = Vector(betas, "betas");
  if (person.betas.size() > 0 && person.betas.cwiseAbs().maxCoeff() > kMostBeta) {
    throw py::value_error("betas: shape coefficients are standard deviations, within 1,000");
  }
  RequireHands(*person.model, side == Side::kRight ? kHoldsRight : kHoldsLeft);
  LoadedObject loaded = ObjectOf(object, object_scale);
  std::shared_ptr<LiveFitter> fitter;
  {
    const py::gil_scoped_release unlocked;
    fitter = std::make_shared<LiveFitter>(std::move(loaded), object_vertices, person, side, options,
                                          1.0 / frame_rate);
  }
  LogNotes(fitter->Object().notes);
  return fitter;
}

}  // namespace

void BindFrameFitter(py::module_& module) {
  py::class_<LiveFitter, std::shared_ptr<LiveFitter>>(
      module, "FrameFitter",
      "Fits an object to one hand, frame after frame, for live use: start() takes hold, each "
      "step() solves one frame, in about a millisecond. hand: 'right' or 'left'; weights as for "
      "fit(); betas (B,) of the body; frame_rate in Hz; object as for fit(). May be called from "
      "several threads: calls wait for each other.\n\n"
      "    fitter = holdfast.FrameFitter('mug')\n"
      "    fitter.start(clip.poses[0], clip.trans[0], R, T)\n"
      "    for poses, trans in frames:\n"
      "        R, T, fingers = fitter.step(poses, trans)\n")
      .def(py::init(&MakeFitter), "object"_a, "hand"_a = "right", py::kw_only(),
           "weights"_a = py::none(), "contact_threshold_mm"_a = 10.0, "slip"_a = false,
           "body"_a = py::none(), "betas"_a = py::none(), "frame_rate"_a = 30.0,
           "object_scale"_a = 1.0, "object_vertices"_a = 300, "threads"_a = 0)
      .def(
          "start",
          [](LiveFitter& self, const py::object& poses, const py::object& trans,
             const py::object& object_rotation, const py::object& object_translation) {
            const JointPose pose = PoseOf(poses);
            const Eigen::Vector3d root = PointOf(trans, "trans");
            const ObjectPose object(RotationOf(object_rotation, "object_rotation"),
                                    PointOf(object_translation, "object_translation"));
            LiveFrame frame;
            {
              const py::gil_scoped_release unlocked;
              frame = self.Start(pose, root, object);
            }
            return TupleOf(frame);
          },
          "poses"_a, "trans"_a, "object_rotation"_a, "object_translation"_a,
          "The hand takes hold as it is: poses (165,) or (55, 3) axis-angle in radians with the "
          "grasping fingers, trans (3,) metres; the object is x_world = R x_object + T, its "
          "rotation (3, 3) or axis-angle (3,). What is too deep in the other comes out. Returns (R "
          "(3, 3), T (3,), fingers (45,)). May be called again.")
      .def(
          "step",
          [](LiveFitter& self, const py::object& poses, const py::object& trans) {
            const JointPose pose = PoseOf(poses);
            const Eigen::Vector3d root = PointOf(trans, "trans");
            LiveFrame frame;
            {
              const py::gil_scoped_release unlocked;
              frame = self.Step(pose, root);
            }
            return TupleOf(frame);
          },
          "poses"_a, "trans"_a,
          "Solves the next frame: the object's R (3, 3) and T (3,) metres, world, and the hand's "
          "fingers (45,) axis-angle in radians. RuntimeError before start().")
      .def_property_readonly(
          "poses",
          [](LiveFitter& self) {
            const JointPose pose = self.Last().body;
            return py::array_t<double>(pose.size(), pose.data());
          },
          "(165,) of the last frame, with the fitted fingers; a copy")
      .def_property_readonly(
          "report",
          [](LiveFitter& self) {
            const LiveFitter::Account last = self.Last();
            nlohmann::json report = EnergiesJson(last.report);
            report["iterations"] = last.report.iterations;
            report["solve_ms"] = last.report.solve_ms;
            report["stop"] = StopReasonName(last.report.stop);
            report["contact_pairs"] = last.contact_pairs;
            return ToPython(report);
          },
          "dict of the last frame: energies by term and unit, iterations, solve_ms, stop "
          "('given' after start(), 'converged', 'iteration_limit', 'failed'), contact_pairs")
      .def_property_readonly(
          "hand", [](const LiveFitter& self) { return std::string(SideName(self.HandSide())); })
      .def_property_readonly(
          "object", [](const LiveFitter& self) { return MeshTuple(self.Object().object.mesh); },
          "(vertices (V, 3) metres, faces (F, 3)), scaled; copies");
}

}  // namespace holdfast::python
