// SPDX-License-Identifier: MIT
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "geometry/options.h"
#include "geometry/rotation.h"
#include "python/src/custom_term.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/fit/clip_state.h"
#include "solver/fit/frame_fitter.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

// Result of one frame.
struct LiveFrame {
  ObjectPose object;
  std::vector<FingerPose> fingers;  // per hand
};

using HandModels = std::vector<std::unique_ptr<const HandModel>>;

// Right, then left, as in FitClip.
HandModels HandsOf(const ClipBody& body, std::uint8_t bits) {
  HandModels hands;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    if ((bits & HoldingBit(side)) == 0) continue;
    hands.push_back(std::make_unique<const HandModel>(body.model, body.betas, side));
  }
  return hands;
}

std::vector<const HandModel*> Pointers(const HandModels& hands) {
  std::vector<const HandModel*> pointers;
  for (const auto& hand : hands) pointers.push_back(hand.get());
  return pointers;
}

// FrameFitter with everything it refers to. Calls are serialized.
class LiveFitter {
 public:
  LiveFitter(std::shared_ptr<const PreparedObject> object, const ClipBody& body, std::uint8_t bits,
             const FitOptions& options, double frame_s)
      : object_(std::move(object)),
        hands_(HandsOf(body, bits)),
        fitter_(Pointers(hands_), object_->fit, options, frame_s) {}

  LiveFrame Start(const JointPose& pose, const Eigen::Vector3d& trans, const ObjectPose& object) {
    const std::scoped_lock guard(lock_);
    for (const auto& hand : hands_) fitter_.Release(hand->HandSide());
    fitter_.Place(object);
    for (const auto& hand : hands_) {
      const Side side = hand->HandSide();
      fitter_.TakeHold(side, pose, trans, FingersOf(pose, side));
      fitter_.Refine(side, pose, trans, hands_.size() == 1);
    }
    last_ = {fitter_.FirstFrame(), fitter_.Body(), fitter_.NumContactPairs()};
    holds_ = true;
    return Frame();
  }

  LiveFrame Step(const JointPose& pose, const Eigen::Vector3d& trans) {
    const std::scoped_lock guard(lock_);
    if (!holds_) throw std::runtime_error("FrameFitter.step: no hold: call start() first");
    last_.report = fitter_.Solve(pose, trans);
    last_.body = fitter_.Body();
    return Frame();
  }

  // Report on the last frame.
  struct Account {
    FrameReport report;
    JointPose body = JointPose::Zero();
    int contact_pairs = 0;
  };
  Account Last() {
    const std::scoped_lock guard(lock_);
    return last_;
  }
  const char* Hand() const {
    return hands_.size() > 1 ? "both" : hands_[0]->HandSide() == Side::kRight ? "right" : "left";
  }
  const PreparedObject& Object() const { return *object_; }

 private:
  LiveFrame Frame() const {
    LiveFrame frame{fitter_.Object(), {}};
    for (const auto& hand : hands_) {
      frame.fingers.push_back(fitter_.Hand(hand->HandSide()).fingers);
    }
    return frame;
  }

  std::mutex lock_;
  std::shared_ptr<const PreparedObject> object_;
  HandModels hands_;
  FrameFitter fitter_;
  bool holds_ = false;
  Account last_;
};

// Converts "right", "left", "both", or a list of the first two, to bits.
std::uint8_t HandBits(const py::object& hand) {
  const auto bit_of = [](const std::string& name) {
    return Choice<std::uint8_t>(
        name, "hand",
        {{"right", kHoldsRight}, {"left", kHoldsLeft}, {"both", kHoldsRight | kHoldsLeft}});
  };
  if (py::isinstance<py::str>(hand)) return bit_of(py::str(hand));
  if (!py::isinstance<py::list>(hand) && !py::isinstance<py::tuple>(hand)) {
    throw py::type_error("hand: expected 'right', 'left', 'both' or a list of them, got " +
                         TypeText(hand));
  }
  std::uint8_t bits = 0;
  for (const py::handle& name : hand) bits |= bit_of(py::str(name));
  if (bits == 0) throw py::value_error("hand: expected one hand or more, got none");
  return bits;
}

Eigen::Vector3d PointOf(const py::object& value, const char* name) {
  const Eigen::Vector3d point = Eigen::Map<const Eigen::Vector3d>(Floats(value, name, {3}).data());
  if (point.cwiseAbs().maxCoeff() > kMaxMeters) {
    throw py::value_error(fmt::format("{}: {}", name, kMetersRemedy));
  }
  return point;
}

JointPose PoseOf(const py::object& value) {
  const bool by_joint = Dimensions(value) == 2;
  const py::array_t<double> numbers =
      by_joint ? Floats(value, "poses", {kNumJoints, 3}) : Floats(value, "poses", {3 * kNumJoints});
  const JointPose pose = Eigen::Map<const JointPose>(numbers.data());
  if (pose.cwiseAbs().maxCoeff() > kMaxRadians) {
    throw py::value_error(fmt::format("poses: {}", kRadiansRemedy));
  }
  return pose;
}

// Converts (3, 3), or axis-angle (3,).
Eigen::Quaterniond RotationOf(const py::object& value, const char* name) {
  if (Dimensions(value) == 1) {
    const Eigen::Vector3d turn = Eigen::Map<const Eigen::Vector3d>(Floats(value, name, {3}).data());
    if (turn.cwiseAbs().maxCoeff() > kMaxRadians) {
      throw py::value_error(fmt::format("{}: {}", name, kRadiansRemedy));
    }
    return Eigen::Quaterniond(ExpSO3(turn));
  }
  const py::array_t<double> numbers = Floats(value, name, {3, 3});
  const Eigen::Matrix3d rotation =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers.data());
  if (!(rotation * rotation.transpose()).isIdentity(1e-3) || rotation.determinant() < 0.0) {
    throw py::value_error(fmt::format(
        "{}: expected a rotation matrix: R R^T within 0.001 of the identity, determinant 1", name));
  }
  return Eigen::Quaterniond(rotation).normalized();
}

py::tuple TupleOf(const LiveFrame& frame) {
  const Eigen::Matrix3d rotation = frame.object.orientation.toRotationMatrix();
  static_assert(sizeof(FingerPose) == 45 * sizeof(double));
  const double* const numbers = frame.fingers.front().data();
  const auto hands = static_cast<py::ssize_t>(frame.fingers.size());
  return py::make_tuple(Rows(rotation.transpose()),
                        py::array_t<double>(3, frame.object.translation.data()),
                        hands == 1 ? py::array_t<double>(45, numbers)
                                   : py::array_t<double>({hands, py::ssize_t{45}}, numbers));
}

std::shared_ptr<LiveFitter> MakeFitter(const py::object& object, const py::object& hand,
                                       const py::object& weights, double contact_threshold_mm,
                                       bool slip, const py::object& body, const py::object& betas,
                                       double frame_rate, double object_scale, int object_vertices,
                                       const py::object& custom_terms, int threads) {
  const std::uint8_t bits = HandBits(hand);
  FitOptions options;
  SetWeights(weights, options);
  options.custom_terms = CustomTermsOf(custom_terms);
  RequirePositive(contact_threshold_mm, "contact_threshold_mm");
  RequirePositive(object_scale, "object_scale");
  RequireBetween(frame_rate, "frame_rate", kLowestFrameRate, kHighestFrameRate);
  RequireBetween(object_vertices, "object_vertices", 4, 100'000);
  options.contact_threshold_m = 1e-3 * contact_threshold_mm;
  options.slip = slip;
  options.threads = ThreadsOf(threads);
  ClipBody person{ModelOf(body), {}};
  if (!betas.is_none()) person.betas = Vector(betas, "betas");
  if (person.betas.size() > 0 && person.betas.cwiseAbs().maxCoeff() > kMaxBeta) {
    throw py::value_error("betas: shape coefficients are standard deviations, within 1,000");
  }
  RequireHands(*person.model, bits);
  const LoadedObject loaded = ObjectOf(object, object_scale);
  const auto prepared = PrepareAside(loaded, object_vertices, options.threads);
  LogNotes(prepared->notes);
  const py::gil_scoped_release unlocked;
  return std::make_shared<LiveFitter>(prepared, person, bits, options, 1.0 / frame_rate);
}

py::tuple StartFitter(LiveFitter& self, const py::object& poses, const py::object& trans,
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
}

py::tuple StepFitter(LiveFitter& self, const py::object& poses, const py::object& trans) {
  const JointPose pose = PoseOf(poses);
  const Eigen::Vector3d root = PointOf(trans, "trans");
  LiveFrame frame;
  {
    const py::gil_scoped_release unlocked;
    frame = self.Step(pose, root);
  }
  return TupleOf(frame);
}

py::object ReportOf(LiveFitter& self) {
  const LiveFitter::Account last = self.Last();
  nlohmann::json report = EnergiesJson(last.report);
  report["wrist_offset_mm"] = 1e3 * last.report.wrist_offset_m;
  report["iterations"] = last.report.iterations;
  report["solve_ms"] = last.report.solve_ms;
  report["stop"] = StopReasonName(last.report.stop);
  report["fault"] = last.report.fault;
  report["contact_pairs"] = last.contact_pairs;
  return ToPython(report);
}

}  // namespace

void BindFrameFitter(py::module_& module) {
  py::class_<LiveFitter, std::shared_ptr<LiveFitter>>(
      module, "FrameFitter",
      R"(Fits an object to one hand or both, frame after frame, for live use.

start() takes hold. Each step() solves one frame, in about a millisecond for one hand. With two
hands, the arms are also adjusted to hold the object together (poses has them). The results are
those of fit(keep_grasp=True) for the same frames. Thread-safe: concurrent calls are serialized.

Parameters
----------
object : str, path or (vertices, faces)
    Mesh file, name of an embedded object, or vertices (V, 3) in meters and faces (F, 3).
hand : {'right', 'left', 'both'} or list, default 'right'
weights : dict, optional
    Weights by term, as in fit().
contact_threshold_mm : float, default 10.0
slip : bool, default False
    As in fit().
body : BodyModel, optional
    In place of the embedded model.
betas : array_like (B,), optional
    Shape coefficients of the body.
frame_rate : float, default 30.0
    Hz.
object_scale : float, default 1.0
object_vertices : int, default 300
custom_terms : list of CustomTerm, optional
    As in fit().
threads : int, default 0
    0: all.

Examples
--------
>>> fitter = holdfast.FrameFitter('mug')
>>> fitter.start(clip.poses[0], clip.trans[0], R, T)
>>> for poses, trans in frames:
...     R, T, fingers = fitter.step(poses, trans)
)")
      .def(py::init(&MakeFitter), "object"_a, "hand"_a = "right", py::kw_only(),
           "weights"_a = py::none(), "contact_threshold_mm"_a = 10.0, "slip"_a = false,
           "body"_a = py::none(), "betas"_a = py::none(), "frame_rate"_a = 30.0,
           "object_scale"_a = 1.0, "object_vertices"_a = 300, "custom_terms"_a = py::none(),
           "threads"_a = 0)
      .def("start", &StartFitter, "poses"_a, "trans"_a, "object_rotation"_a, "object_translation"_a,
           R"(Starts the hold from a pose. May be called again.

The object is at x_world = R x_object + T. Deep penetration of hand and object is resolved.

Parameters
----------
poses : array_like (165,) or (55, 3)
    Axis-angle in radians, with the grasping fingers.
trans : array_like (3,)
    Meters.
object_rotation : array_like (3, 3) or (3,)
    R: a matrix, or axis-angle.
object_translation : array_like (3,)
    T, meters.

Returns
-------
R : array (3, 3)
T : array (3,)
fingers : array (45,) or (2, 45)
    As in step().
)")
      .def("step", &StepFitter, "poses"_a, "trans"_a,
           R"(Solves the next frame.

Parameters
----------
poses : array_like (165,) or (55, 3)
    Axis-angle, radians.
trans : array_like (3,)
    Meters.

Returns
-------
R : array (3, 3)
    Rotation of the object, object to world.
T : array (3,)
    Its translation, meters, world.
fingers : array (45,) or (2, 45)
    Axis-angle in radians; of both hands, right and left.

Raises
------
RuntimeError
    Before start().
)")
      .def_property_readonly(
          "poses",
          [](LiveFitter& self) {
            const JointPose pose = self.Last().body;
            return py::array_t<double>(pose.size(), pose.data());
          },
          "(165,) of the last frame, with the fitted fingers and, of two hands, arms; a copy")
      .def_property_readonly(
          "report", &ReportOf,
          "dict of the last frame: energies by term and unit, wrist_offset_mm (the farther wrist "
          "from its pose), iterations, solve_ms, stop "
          "('given' after start(), 'converged', 'iteration_limit', 'failed'), fault (what a custom "
          "term did wrong, or ''), contact_pairs")
      .def_property_readonly("hand", &LiveFitter::Hand, "'right', 'left' or 'both'")
      .def_property_readonly(
          "object", [](const LiveFitter& self) { return MeshTuple(self.Object().object.mesh); },
          "(vertices (V, 3) meters, faces (F, 3)), scaled; copies")
      .def("__repr__", [](const LiveFitter& self) {
        return fmt::format(
            "<holdfast.FrameFitter: {} in {}>", self.Object().object.name,
            self.Hand() == std::string("both") ? "both hands" : self.Hand() + std::string(" hand"));
      });
}

}  // namespace holdfast::python
