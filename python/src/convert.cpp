// SPDX-License-Identifier: MIT
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "generator/body/hand_onto_body.h"
#include "geometry/io/motion/motion_file.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

struct ConvertedMotion {
  ClipPtr clip;
  ModelPtr body;
  Conversion conversion;  // without its clip
};
using ConvertedPtr = std::shared_ptr<ConvertedMotion>;

// Imports files of other programs without changing their world frame.
ClipArgument SourceOf(const py::object& clip, const py::object& from_body,
                      const std::string& from_hands) {
  ImportFileOptions import;
  import.parameters.up = UpAxis::kZ;
  import.parameters.keep_ground = true;
  import.parameters.flat_hand_mean = Choice<std::optional<bool>>(from_hands, "from_hands",
                                                                 {{"auto", std::nullopt},
                                                                  {"complete", true},
                                                                  { "relative",
                                                                    false }});
  const ModelPtr from = ModelOf(from_body, "from_body");
  ClipArgument source = ClipOf(clip, from_body, "clip", import);
  if (!source.imported && from_hands == "relative") {
    for (JointPose& pose : source.clip->pose) pose = AddHandMean(*from, pose);
  }
  return source;
}

ConvertedPtr Convert(const py::object& clip, const py::object& to_body, const py::object& from_body,
                     const std::string& from_hands, int betas, const py::object& onto) {
  RequireBetween(betas, "betas", 0, 300);
  auto converted = std::make_shared<ConvertedMotion>();
  converted->body = ModelOf(to_body, "to_body");
  const ClipArgument source = SourceOf(clip, from_body, from_hands);
  if (onto.is_none()) {
    converted->conversion = RunAside([source, to = converted->body, betas] {
      return Conversion{ConvertClip(*source.clip, source.body.model, source.body.betas, to, betas),
                        {}};
    });
  } else {
    const ClipArgument person = ClipOf(onto, to_body, "onto");
    converted->conversion = RunAside([source, person] {
      return ConvertOntoBody(*source.clip, source.body, *person.clip, person.body);
    });
  }
  converted->clip = std::make_shared<Clip>(std::move(converted->conversion.clip));
  return converted;
}

// A part of ConversionJson, or None if there is no part of this name.
py::object Part(const ConvertedMotion& self, const char* name) {
  return ToPython(ConversionJson(self.conversion).value(name, nlohmann::json()));
}

void Save(const ConvertedMotion& self, const std::filesystem::path& path, const std::string& layout,
          const std::string& hands, bool force) {
  const ModelKind kind = self.body->Kind();
  const std::string family = self.body->LoneHand() ? "mano" : std::string(ModelKindName(kind));
  const bool json = path.extension() == ".json";
  const auto as =
      Choice<ParameterLayout>(layout, "layout",
                              {{"auto", json ? ParameterLayout::kPackage : ParameterLayout::kAmass},
                               {"amass", ParameterLayout::kAmass},
                               {family.c_str(), ParameterLayout::kPackage}});
  const bool complete = Choice<bool>(hands, "hands", {{"complete", true}, {"relative", false}});
  RequireInRange(*self.clip, "clip");
  RequireNew(path, force);
  Clip out = *self.clip;
  const py::gil_scoped_release unlocked;
  if (!complete) {
    for (JointPose& pose : out.pose) pose = RemoveHandMean(*self.body, pose);
  }
  WriteParameters(out, kind, as, complete, path);
}

}  // namespace

void BindConvert(py::module_& module) {
  py::class_<ConvertedMotion, ConvertedPtr>(module, "ConvertResult",
                                            "A clip in the parameters of another body model.")
      .def_readonly("clip", &ConvertedMotion::clip,
                    "Clip for the other model, finger angles complete (flat_hand_mean=True)")
      .def_readonly("body", &ConvertedMotion::body, "BodyModel of the parameters")
      .def_property_readonly(
          "residual", [](const ConvertedMotion& self) { return Part(self, "residual"); },
          "dict of joint distances from the source: 'joints' by name, 'mean_mm', 'max_mm'; "
          "'vertex_mean_mm', 'vertex_max_mm' where both models have the same triangles")
      .def_property_readonly(
          "arm", [](const ConvertedMotion& self) { return Part(self, "arm"); },
          "dict: 'frames_out_of_reach', 'max_missing_mm' of a hand attached to a body; or None")
      .def_property_readonly(
          "not_carried_over",
          [](const ConvertedMotion& self) { return Part(self, "not_carried_over"); },
          "list of str: what the other model cannot represent")
      .def("save", &Save, "path"_a, py::kw_only(), "layout"_a = "auto", "hands"_a = "complete",
           "force"_a = false,
           "Writes the parameters, .npz or .json. layout: names of the arrays: 'amass', the smplx "
           "package's ('smplx', 'smplh' or 'mano', matching the model), or 'auto': by the "
           "extension, AMASS's in .npz. hands: finger angles 'complete' (flat_hand_mean), or "
           "'relative' to the model's mean hand. Raises Error if the file exists, unless "
           "force=True.")
      .def("__repr__", [](const ConvertedMotion& self) {
        return fmt::format("<holdfast.ConvertResult: {} frames for {}, joints within {:.3f} mm>",
                           self.clip->NumFrames(), self.body->Name(), self.conversion.max_mm);
      });
  module.def(
      "convert", &Convert, "clip"_a, py::kw_only(), "to_body"_a, "from_body"_a = py::none(),
      "from_hands"_a = "auto", "betas"_a = kConvertedBetas, "onto"_a = py::none(),
      "Converts parameters of one body model to those of another: SMPL-X, SMPL-H, MANO.\n"
      "\n"
      "Rotations are kept; trans is corrected for the offset between the models' pelvises (for a "
      "hand: wrists); betas are fitted to the joints; the result has the remaining errors.\n"
      "\n"
      "clip: a Clip, a path or an embedded name; the world axes of other programs' files are not "
      "changed. to_body, from_body: a BodyModel, or None for the embedded one. from_hands: finger "
      "angles of the clip are 'complete' (flat_hand_mean), 'relative' to its model's mean hand, or "
      "'auto': by its format. betas: shape coefficients to solve for, 0 to 300; 0: the mean shape. "
      "onto: for a clip of a hand alone, the clip of the body to attach it to, with the same "
      "number of frames; the arm is solved so that the wrist is at the hand. Returns "
      "ConvertResult. Raises Error for models that cannot be converted into each other.\n"
      "\n"
      "    smplh = holdfast.BodyModel.load('SMPLH_MALE.pkl')\n"
      "    holdfast.convert('walk.npz', to_body=smplh).save('walk_h.npz')");
}

}  // namespace holdfast::python
