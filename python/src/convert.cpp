// SPDX-License-Identifier: MIT
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "generator/body/hand_onto_body.h"
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

ConvertedPtr Convert(const py::object& clip, const py::object& to_body, const py::object& from_body,
                     const py::object& onto, const py::kwargs& given) {
  ConvertOptions options;
  SetOptions(given, OptionsOf(options));
  auto converted = std::make_shared<ConvertedMotion>();
  converted->body = ModelOf(to_body, "to_body");
  const ModelPtr from = ModelOf(from_body, "from_body");
  ClipArgument source = ClipOf(clip, from_body, "clip", ImportToConvert(options));
  if (!source.imported) {
    source.clip = std::make_shared<Clip>(*source.clip);
    CompleteHands(options, *from, *source.clip);
  }
  if (onto.is_none()) {
    converted->conversion = RunAside([source, to = converted->body, betas = options.betas] {
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

void Save(const ConvertedMotion& self, const std::filesystem::path& path, bool force,
          const py::kwargs& given) {
  ParameterFileOptions options;
  SetOptions(given, OptionsOf(options));
  RequireInRange(*self.clip, "clip");
  RequireNew(path, force);
  const py::gil_scoped_release unlocked;
  WriteParameters(*self.clip, *self.body, options, path);
}

constexpr const char* kConvertDoc =
    R"(Converts parameters of one body model to those of another: SMPL-X, SMPL-H, MANO.

Rotations are kept. trans is corrected for the offset between the models' pelvises (for a hand:
wrists). betas are fitted to the joints. The result has the remaining errors.

Parameters
----------
clip : Clip, str or path
    Clip, file, or name of an embedded clip. The world axes of other programs' files are not
    changed.
to_body : BodyModel or None
    None: the embedded model.
from_body : BodyModel, optional
    Default: the embedded model.
onto : Clip, str or path, optional
    For a clip of a hand alone: the clip of the body to attach the hand to, with the same number
    of frames. The arm is solved so that the body's wrist is at the hand's wrist.
@options

Returns
-------
ConvertResult

Raises
------
Error
    If the models cannot be converted into each other.

Examples
--------
>>> smplh = holdfast.BodyModel.load('SMPLH_MALE.pkl')
>>> holdfast.convert('walk.npz', to_body=smplh).save('walk_h.npz')
)";

constexpr const char* kSaveParametersDoc =
    R"(Writes the parameters, .npz or .json.

Parameters
----------
path : path
force : bool, default False
    Overwrite an existing file.
@options

Raises
------
Error
    If the file exists, unless force=True.
)";

}  // namespace

void BindConvert(py::module_& module) {
  ConvertOptions usual;
  ParameterFileOptions file;
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
      .def("save", &Save, "path"_a, py::kw_only(), "force"_a = false,
           WithOptions(kSaveParametersDoc, OptionsOf(file)).c_str())
      .def("__repr__", [](const ConvertedMotion& self) {
        return fmt::format("<holdfast.ConvertResult: {} frames for {}, joints within {:.3f} mm>",
                           self.clip->NumFrames(), self.body->Name(), self.conversion.max_mm);
      });
  module.def("convert", &Convert, "clip"_a, py::kw_only(), "to_body"_a, "from_body"_a = py::none(),
             "onto"_a = py::none(), WithOptions(kConvertDoc, OptionsOf(usual)).c_str());
}

}  // namespace holdfast::python
