// SPDX-License-Identifier: MIT
#include "solver/robot/robot.h"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "geometry/io/gltf/mjcf_writer.h"
#include "geometry/rotation.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"
#include "solver/robot/robot_baselines.h"
#include "solver/trial/robot_scene.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

// Shared data of the transfers of one clip to one robot.
struct RobotCase {
  RobotTransferSetup setup;
  RobotTransferOptions options;
  Clip clip;
};

struct TransferredRobot {
  std::shared_ptr<const RobotCase> of;
  RobotTransfer transfer;
  RobotMeasures measures;

  const RobotTransferSetup& Setup() const { return of->setup; }
};
using TransferredPtr = std::shared_ptr<TransferredRobot>;

TransferredPtr Transfer(const py::object& clip, const std::filesystem::path& robot,
                        const py::object& correspondence, const std::string& contacts,
                        const py::object& object, double object_scale, const py::object& body,
                        int threads, const py::object& progress, const py::kwargs& given) {
  RobotTransferOptions options;
  SetOptions(given, OptionsOf(options));
  options.threads = ThreadsOf(threads);
  options.contacts = contacts;
  if (!correspondence.is_none()) {
    options.correspondence_source = "correspondence";
    for (const auto& [part, link] :
         correspondence.cast<std::vector<std::pair<std::string, std::string>>>()) {
      options.correspondence.push_back({part, link});
    }
  }
  RobotHand read = ReadRobotHand(robot);
  LogNotes(read.notes);
  const ReportInput scene = SceneOf(clip, object, object_scale, body);
  auto out = std::make_shared<TransferredRobot>();
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    out->of.reset(
        new RobotCase{PrepareRobotTransfer(scene, std::move(read), options), options, scene.clip});
    out->transfer = TransferToRobot(out->Setup(), options, go_on);
    if (!out->transfer.stopped) {
      out->measures = MeasureTransfer(out->Setup(), out->transfer.poses, options.threads);
    }
  });
  if (out->transfer.stopped) throw Stopped();
  return out;
}

TransferredPtr ByBaseline(const TransferredPtr& self, const std::string& method) {
  const auto baseline =
      Choice<RobotBaseline>(method, "method",
                            {{"laplacian", RobotBaseline::kLaplacian},
                             {"keypoints", RobotBaseline::kKeypoints},
                             {"fingertip-vectors", RobotBaseline::kFingertipVectors}});
  return RunAside([of = self->of, baseline] {
    auto out = std::make_shared<TransferredRobot>();
    out->of = of;
    out->transfer = TransferByBaseline(of->setup, baseline);
    out->measures = MeasureTransfer(of->setup, out->transfer.poses, of->options.threads);
    return out;
  });
}

py::object TryIt(const TransferredPtr& self, bool human, double friction) {
  RequireBetween(friction, "friction", 0.0, 100.0);
  const std::optional<HoldTrial> trial = RunAside([self, human, friction]() {
    RequirePhysics();
    const RobotTransferSetup& setup = self->Setup();
    TrialProtocol protocol;
    protocol.scene.friction = friction;
    protocol.threads = self->of->options.threads;
    const TrialSolid solid = MakeTrialSolid(setup.object, *setup.object_distance, protocol);
    const int frame = FullestFrame(setup.demonstration);
    return human ? TryHumanHold(setup, self->of->clip, frame, solid, protocol)
                 : TryRobotHold(setup, self->transfer.poses[frame], solid, protocol);
  });
  if (!trial) return py::none();
  return py::dict("held_directions"_a = trial->Held(), "worst_slip_mm"_a = trial->WorstSlip_mm(),
                  "worst_slip_deg"_a = trial->WorstSlip_deg(), "mass_kg"_a = trial->mass_kg,
                  "grip_N"_a = trial->grip_N);
}

py::dict Play(const TransferredPtr& self) {
  const RobotPlay play = RunAside([of = self->of, poses = self->transfer.poses] {
    const RobotInScene robot{&of->setup, &poses};
    return PlayRobotTransfer(std::span(&robot, 1), of->options.threads);
  });
  return py::dict(
      "off_mm"_a = py::array_t<double>(py::ssize_t(play.off_mm.size()), play.off_mm.data()),
      "off_deg"_a = py::array_t<double>(py::ssize_t(play.off_deg.size()), play.off_deg.data()),
      "most_mm"_a = play.most_mm, "most_deg"_a = play.most_deg, "holds"_a = play.holds,
      "stable"_a = play.stable);
}

// (T, joints) of the independent joints.
py::array_t<double> Joints(const TransferredRobot& self) {
  const RobotHand& robot = self.Setup().robot;
  Eigen::MatrixXd angles(robot.NumDofs(), static_cast<Eigen::Index>(self.transfer.poses.size()));
  for (Eigen::Index t = 0; t < angles.cols(); ++t) angles.col(t) = self.transfer.poses[t].q;
  return Rows(angles);
}

py::tuple Wrist(const TransferredRobot& self) {
  const auto frames = static_cast<Eigen::Index>(self.transfer.poses.size());
  Eigen::Matrix3Xd orient(3, frames), trans(3, frames);
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (Eigen::Index t = 0; t < frames; ++t) {
    const Eigen::Isometry3d pose = self.Setup().demonstration.frames[t].world_from_object *
                                   self.transfer.poses[t].ObjectFromRoot();
    before = UnwrapAxisAngle(LogSO3(pose.linear()), before);
    orient.col(t) = before;
    trans.col(t) = pose.translation();
  }
  return py::make_tuple(Rows(orient), Rows(trans));
}

py::list Contacts(const TransferredRobot& self) {
  py::list all;
  for (std::size_t t = 0; t < self.measures.frames.size(); ++t) {
    const Eigen::Isometry3d& world = self.Setup().demonstration.frames[t].world_from_object;
    for (const RobotContact& contact : self.measures.frames[t].contacts) {
      const Eigen::Matrix3Xd point = world * contact.point;
      const Eigen::Matrix3Xd normal = world.linear() * contact.normal;
      all.append(py::dict("frame"_a = t, "link"_a = self.Setup().robot.links[contact.link].name,
                          "point"_a = Rows(point), "normal"_a = Rows(normal),
                          "distance_m"_a = contact.distance_m));
    }
  }
  return all;
}

constexpr const char* kTransferToRobotDoc =
    R"(Transfers the hand of a clip that holds the object to a robot's hand.

Keeps contacts and avoids penetration.

Parameters
----------
clip : Clip, result, str or path
    Clip, result of fit(), file, result folder, or name of an embedded clip.
robot : path
    URDF or MJCF.
correspondence : list of (part, link), optional
    As in RobotHand.parts.
contacts : str, optional
    File of contacts that replace the clip's: an edited contacts.json (docs/robots.md).
object : str, path or (vertices, faces), optional
    Mesh in place of the clip's, as in score().
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
RobotTransfer

Raises
------
Stopped
    If progress returns False.
Error
    For invalid input.
)";

}  // namespace

void BindRobot(py::module_& module) {
  py::class_<RobotHand>(module, "RobotHand", R"(A robot's hand: links, joints, fingers.

Parameters
----------
path : path
    URDF (.urdf) or MJCF (.xml).

Raises
------
Error
    For an invalid file.
)")
      .def(py::init([](const std::filesystem::path& path) { return ReadRobotHand(path); }),
           "path"_a)
      .def("__repr__",
           [](const RobotHand& self) {
             return fmt::format("<holdfast.RobotHand: {}, {} joints>", self.name, self.NumDofs());
           })
      .def_readonly("name", &RobotHand::name, "str: name of the robot")
      .def_readonly("notes", &RobotHand::notes, "list of str: what was ignored or repaired")
      .def_property_readonly(
          "joints",
          [](const RobotHand& self) {
            py::dict joints;
            for (const RobotDof& dof : self.dofs) {
              joints[py::str(dof.name)] = py::make_tuple(dof.low, dof.high);
            }
            return joints;
          },
          "dict: limits (radians or meters) of each independent joint, by name")
      .def_property_readonly(
          "parts",
          [](const RobotHand& self) {
            std::vector<std::pair<std::string, std::string>> parts;
            for (const PartLink& row : PartLinksOf(self, FindAnatomy(self))) {
              parts.emplace_back(row.part, row.link);
            }
            return parts;
          },
          "list of (part, link): detected links of each part of a human hand");
  py::class_<TransferredRobot, TransferredPtr>(module, "RobotTransfer",
                                               "A clip's hand, transferred to a robot's.")
      .def("__repr__",
           [](const TransferredRobot& self) {
             return fmt::format("<holdfast.RobotTransfer: {} frames on {}>",
                                self.transfer.poses.size(), self.Setup().robot.name);
           })
      .def_property_readonly(
          "robot", [](const TransferredRobot& self) { return self.Setup().robot; }, "RobotHand")
      .def_property_readonly("joint_angles", &Joints,
                             "(T, J) radians or meters, columns in the order of robot.joints")
      .def_property_readonly("wrist", &Wrist,
                             "(orient (T, 3), trans (T, 3)): axis-angle and place of the robot's "
                             "root in the world")
      .def_property_readonly("contacts", &Contacts,
                             "list of dict: 'frame', 'link', 'point' (1, 3), 'normal' (1, 3), "
                             "'distance_m'")
      .def_property_readonly(
          "metrics",
          [](const TransferredRobot& self) { return ToPython(RobotMeasuresJson(self.measures)); },
          "dict: contacts kept, penetration; as metrics.json")
      .def_property_readonly(
          "human_metrics",
          [](const TransferredPtr& self) {
            return ToPython(RobotMeasuresJson(RunAside(
                [of = self->of] { return MeasureHuman(of->setup, of->options.threads); })));
          },
          "dict: the same measures of the clip's human hand")
      .def_property_readonly(
          "solve_ms", [](const TransferredRobot& self) { return self.transfer.solve_ms; },
          "wall time to solve all frames, ms, without the search for a start in the first frame")
      .def("baseline", &ByBaseline, "method"_a,
           R"(Transfers the same clip to the same robot by a published method.

Parameters
----------
method : {'laplacian', 'keypoints', 'fingertip-vectors'}
    'laplacian': an interaction mesh (OmniRetarget, Yang et al. 2025). 'keypoints': inverse
    kinematics of fingertips and wrist. 'fingertip-vectors': DexPilot (Handa et al. 2020).

Returns
-------
RobotTransfer
)")
      .def("hold_trial", &TryIt, "human"_a = false, py::kw_only(),
           "friction"_a = TrialProtocol{}.scene.friction,
           R"(Simulates with MuJoCo whether the hand keeps the object.

Gravity acts in six directions, in the frame with most contacts.

Parameters
----------
human : bool, default False
    Try the clip's human hand.
friction : float, default 0.8
    Coefficient of friction.

Returns
-------
dict or None
    'held_directions', slips in mm and degrees, 'mass_kg' and 'grip_N'. None for a hand with sliding
    joints.

Raises
------
Error
    Without MuJoCo.
)")
      .def("play", &Play,
           R"(Plays the clip in MuJoCo: the scene of save_scene(), with gravity and friction 0.8.

The robot's own joints follow the transfer by position controllers (hinges: 3 N m per radian, at
most 1.5 N m; slides: 1000 N/m, at most 40 N). Each hold is played from its first frame to its last.

Returns
-------
dict
    'off_mm', 'off_deg': (T,) how far the object is from the clip's path, NaN where no hand holds
    it. 'most_mm', 'most_deg': their largest values. 'holds': number played. 'stable': False if
    MuJoCo diverged.

Raises
------
Error
    Without MuJoCo, or for an object without volume.
)")
      .def(
          "save",
          [](const TransferredRobot& self, const std::filesystem::path& path, bool force) {
            RequireNew(path, force);
            if (path.stem().string().ends_with("motion_v1")) {
              WriteMotionV1(self.Setup(), self.transfer.poses, self.measures,
                            path.parent_path().filename().string(), "object.obj", path);
            } else {
              WriteRobotMotion(self.Setup(), self.transfer.poses, self.measures, path);
            }
          },
          "path"_a, py::kw_only(), "force"_a = false,
          R"(Writes robot.npz (docs/robots.md).

Parameters
----------
path : path
    With a name that ends in motion_v1.npz: the schema of video_to_data, whose object_mesh_paths is
    'object.obj'.
force : bool, default False
    Overwrite an existing file.

Raises
------
Error
    If the file exists, unless force=True.
)")
      .def(
          "save_scene",
          [](const TransferredRobot& self, const std::filesystem::path& path, bool force) {
            RequireNew(path, force);
            RequireNew(MjcfAssets(path), force);
            const RobotTransferSetup& setup = self.Setup();
            const RobotInScene robot{&setup, &self.transfer.poses};
            WriteRobotScene(std::span(&robot, 1),
                            MakeTrialSolid(setup.object, *setup.object_distance, TrialProtocol()),
                            path);
          },
          "path"_a, py::kw_only(), "force"_a = false,
          R"(Writes a scene for MuJoCo, with its meshes in a folder beside it.

Parameters
----------
path : path
    File (.xml).
force : bool, default False
    Overwrite an existing file and folder.

Raises
------
Error
    If the file or folder exists, unless force=True.
)");
  RobotTransferOptions usual;
  module.def("transfer_to_robot", &Transfer, "clip"_a, "robot"_a, py::kw_only(),
             "correspondence"_a = py::none(), "contacts"_a = "", "object"_a = py::none(),
             "object_scale"_a = 1.0, "body"_a = py::none(), "threads"_a = 0,
             "progress"_a = py::none(), WithOptions(kTransferToRobotDoc, OptionsOf(usual)).c_str());
}

}  // namespace holdfast::python
