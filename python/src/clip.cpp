// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/clip/resample.h"
#include "geometry/import/load_clip.h"
#include "geometry/suggestion.h"
#include "python/src/bindings.h"
#include "python/src/numpy.h"
#include "python/src/run.h"

namespace holdfast::python {
namespace {

using namespace py::literals;

void RequireLength(py::ssize_t found, int frames, const char* name) {
  if (found != frames) {
    throw py::value_error(
        fmt::format("{}: expected {} rows, one for each frame, got {}", name, frames, found));
  }
}

std::vector<std::uint8_t> HoldingBits(const py::handle& value, int frames) {
  if (value.is_none()) return {};
  const py::array_t<int> bits = Integers(value, "holding_hand", {-1});
  RequireLength(bits.size(), frames, "holding_hand");
  std::vector<std::uint8_t> result;
  for (py::ssize_t t = 0; t < bits.size(); ++t) {
    const int bit = bits.data()[t];
    if (bit < 0 || bit > 3) {
      throw py::value_error(fmt::format(
          "holding_hand[{}] is {}: expected 0 nobody, 1 right hand, 2 left hand, 3 both", t, bit));
    }
    result.push_back(static_cast<std::uint8_t>(bit));
  }
  return result;
}

double PositiveRate(double frame_rate) {
  if (!(frame_rate > 0.0) || !std::isfinite(frame_rate)) {
    throw py::value_error("frame_rate: expected more than 0 Hz");
  }
  return frame_rate;
}

ClipPtr MakeClip(const py::object& poses, const py::object& trans, const py::object& betas,
                 double frame_rate, const std::string& gender, const std::string& model_type,
                 const py::object& object, const py::object& holding_hand) {
  auto clip = std::make_shared<Clip>();
  clip->pose = Poses(poses, "poses");
  if (clip->pose.empty()) throw py::value_error("poses: expected one frame or more, got none");
  clip->trans = Columns(trans, "trans", clip->NumFrames());
  if (!betas.is_none()) clip->betas = Vector(betas, "betas");
  clip->frame_rate = PositiveRate(frame_rate);
  clip->gender = gender;
  clip->surface_model_type = model_type;
  if (!object.is_none()) {
    clip->object = object.cast<ObjectTrack>();
    RequireLength(clip->object->trans.cols(), clip->NumFrames(), "object");
  }
  clip->holding_hand = HoldingBits(holding_hand, clip->NumFrames());
  RequireInRange(*clip, "Clip");
  return clip;
}

// Columns [begin, end) of the poses as a view (T, end - begin).
py::array_t<double> PoseColumns(const py::object& self, int begin, int end) {
  Clip& clip = self.cast<Clip&>();
  constexpr py::ssize_t kRow = 3 * kNumJoints * sizeof(double);
  return py::array_t<double>({static_cast<py::ssize_t>(clip.NumFrames()), py::ssize_t{end - begin}},
                             {kRow, static_cast<py::ssize_t>(sizeof(double))},
                             clip.pose.front().data() + begin, self);
}

// Arguments of smplx's forward, by name (use_pca=False, flat_hand_mean=True).
py::dict ToSmplx(const py::object& self) {
  const auto columns = [&](int first, int count) {
    return PoseColumns(self, 3 * first, 3 * (first + count));
  };
  Clip& clip = self.cast<Clip&>();
  py::array_t<double> betas({py::ssize_t{1}, static_cast<py::ssize_t>(clip.betas.size())});
  std::copy_n(clip.betas.data(), clip.betas.size(), betas.mutable_data());
  return py::dict("global_orient"_a = columns(kPelvis, 1), "body_pose"_a = columns(1, 21),
                  "jaw_pose"_a = columns(kJaw, 1), "leye_pose"_a = columns(kLeftEye, 1),
                  "reye_pose"_a = columns(kRightEye, 1),
                  "left_hand_pose"_a = columns(kLeftHandBegin, kJointsPerHand),
                  "right_hand_pose"_a = columns(kRightHandBegin, kJointsPerHand),
                  "transl"_a = RowsOf(clip.trans, self), "betas"_a = betas);
}

// Loads a clip of any kind, with its object mesh if the file has or names one.
LoadedClip Load(const std::string& path, const py::object& body, ImportFileOptions options = {}) {
  if (!body.is_none()) options.parameters.body = body.cast<ModelPtr>();
  LoadedClip loaded = RunAside([path, options] {
    LoadedClip clip = LoadClip(path, options);
    try {
      if (ClipObject own = FindClipObject(clip); own.mesh && !own.by_name) {
        clip.clip.object->surface = std::make_shared<const TriangleMesh>(std::move(*own.mesh));
      }
    } catch (const Error& error) {  // an error only if the mesh is needed
      clip.notes.push_back(error.what());
      clip.clip.object->mesh =
          std::filesystem::absolute(clip.file.parent_path() / clip.clip.object->mesh).string();
    }
    return clip;
  });
  LogNotes(loaded.notes);
  return loaded;
}

ClipPtr LoadAny(const py::object& source, const py::object& body,
                const std::optional<double>& frame_rate, const py::object& betas,
                const std::vector<std::string>& hand_models, const py::kwargs& given) {
  if (frame_rate && !(*frame_rate >= 0.0)) {
    throw py::value_error("frame_rate: expected 0 (the file's) or more");
  }
  ImportFileOptions options;
  SetOptions(given, OptionsOf(options).Without({"fps"}));
  options.frame_rate = frame_rate;
  if (!betas.is_none()) options.motion.betas = Vector(betas, "betas");
  options.parameters.hand_models.assign(hand_models.begin(), hand_models.end());
  if (!py::isinstance<py::dict>(source)) {
    if (!IsPath(source)) {
      throw py::type_error("path: expected a path or a dict of arrays, got " + TypeText(source));
    }
    return std::make_shared<Clip>(Load(py::str(source), body, std::move(options)).clip);
  }
  const py::object file = py::module_::import("holdfast.results").attr("stored_parameters")(source);
  return std::make_shared<Clip>(Load(py::str(file.attr("path")), body, std::move(options)).clip);
}

// The rows of one of smplx's arguments: (T, 3 count), (T, count, 3), or (T, count, 1, 3).
py::array_t<double> SmplxRows(const py::dict& parameters, const char* name, int count) {
  const py::array array = py::array::ensure(parameters[name]);
  const py::ssize_t frames = array && array.ndim() > 0 ? array.shape(0) : 0;
  if (!array || array.size() != 3 * count * frames) {
    throw py::value_error(fmt::format(
        "{}: expected (T, {}) numbers{}", name, 3 * count,
        count == kJointsPerHand ? "; hands stored as principal components need import_motion"
                                : ""));
  }
  return Floats(array.attr("reshape")(frames, 3 * count), name, {-1, 3 * count});
}

// What ToSmplx returned, or arguments of the same names. Joints that are not there are zero.
ClipPtr FromSmplx(const py::dict& given, double frame_rate, const std::string& gender,
                  const py::object& object, const py::object& holding_hand) {
  constexpr std::tuple<const char*, int, int> kParts[] = {
      {"global_orient", kPelvis, 1},
      {"body_pose", 1, 21},
      {"jaw_pose", kJaw, 1},
      {"leye_pose", kLeftEye, 1},
      {"reye_pose", kRightEye, 1},
      {"left_hand_pose", kLeftHandBegin, kJointsPerHand},
      {"right_hand_pose", kRightHandBegin, kJointsPerHand}};
  const py::dict parameters = py::module_::import("holdfast.results").attr("arrays")(given);
  std::vector<std::string> known = {"transl", "betas", "expression"};
  for (const auto& part : kParts) known.emplace_back(std::get<0>(part));
  for (const auto& [key, value] : parameters) {
    const std::string name = py::str(key);
    if (std::ranges::find(known, name) != known.end()) continue;
    throw py::type_error(fmt::format("parameters: unknown name '{}'. {}smplx's are: {}", name,
                                     Suggestion(name, known), fmt::join(known, ", ")));
  }
  if (!parameters.contains("global_orient")) {
    throw py::type_error(
        "parameters: expected 'global_orient' (T, 3), and others of smplx's names");
  }
  const py::ssize_t frames = SmplxRows(parameters, "global_orient", 1).shape(0);
  py::array_t<double> poses({frames, py::ssize_t{3 * kNumJoints}}), trans({frames, py::ssize_t{3}});
  for (py::array_t<double>* array : {&poses, &trans}) {
    std::fill_n(array->mutable_data(), array->size(), 0.0);
  }
  for (const auto& [name, first, count] : kParts) {
    if (!parameters.contains(name)) continue;
    const py::array_t<double> rows = SmplxRows(parameters, name, count);
    RequireLength(rows.shape(0), static_cast<int>(frames), name);
    for (py::ssize_t t = 0; t < frames; ++t) {
      std::copy_n(rows.data(t, 0), 3 * count, poses.mutable_data(t, 3 * first));
    }
  }
  if (parameters.contains("transl")) trans = SmplxRows(parameters, "transl", 1);
  py::object betas = py::none();
  if (parameters.contains("betas")) {
    betas = parameters["betas"];
    if (Dimensions(betas) == 2) betas = py::array::ensure(betas).attr("mean")(0);
  }
  return MakeClip(poses, trans, betas, frame_rate, gender, "smplx", object, holding_hand);
}

ClipPtr SliceOf(const Clip& clip, const py::slice& slice) {
  py::ssize_t begin, end, step, length;
  if (!slice.compute(clip.NumFrames(), &begin, &end, &step, &length)) throw py::error_already_set();
  if (step != 1) throw py::value_error("a clip is sliced in steps of one frame: use resample()");
  if (length == 0) throw py::value_error("the slice has no frames");
  return std::make_shared<Clip>(
      Slice(clip, static_cast<int>(begin), static_cast<int>(begin + length)));
}

void BindTrack(py::module_& module) {
  py::class_<ObjectTrack>(module, "ObjectTrack",
                          R"(The trajectory of an object in a clip: x_world = R x_object + T.

Parameters
----------
trans : array_like (T, 3)
    Meters, world.
orient : array_like (T, 3)
    Axis-angle, radians.
name : str, optional
mesh : str, optional
    File of the object's mesh, relative to the clip's, or an embedded name.
surface : path or (vertices, faces), optional
    The mesh itself: a mesh file, or vertices (V, 3) in meters and faces (F, 3).
)")
      .def(py::init([](const py::object& trans, const py::object& orient, std::string name,
                       std::string mesh, const py::object& surface) {
             ObjectTrack track;
             track.trans = Columns(trans, "trans");
             track.orient = Columns(orient, "orient", track.trans.cols());
             track.name = std::move(name);
             track.mesh = std::move(mesh);
             if (!surface.is_none()) {
               track.surface =
                   std::make_shared<const TriangleMesh>(MeshArgument(surface, "surface"));
             }
             return track;
           }),
           "trans"_a, "orient"_a, "name"_a = "", "mesh"_a = "", "surface"_a = py::none())
      .def_property_readonly(
          "trans",
          [](const py::object& self) { return RowsOf(self.cast<ObjectTrack&>().trans, self); },
          "(T, 3) meters, world; a view")
      .def_property_readonly(
          "orient",
          [](const py::object& self) { return RowsOf(self.cast<ObjectTrack&>().orient, self); },
          "(T, 3) axis-angle, radians, of column vectors; a view")
      .def_readwrite("name", &ObjectTrack::name)
      .def_readwrite("mesh", &ObjectTrack::mesh, "file of the mesh, relative to the clip")
      .def_property_readonly(
          "surface",
          [](const ObjectTrack& track) -> py::object {
            if (!track.surface) return py::none();
            return MeshTuple(*track.surface);
          },
          "(vertices (V, 3) meters, faces (F, 3)) of the object, copies: from the clip's file or "
          "the file it references, or the fitted object; None if unknown")
      .def("__len__", [](const ObjectTrack& track) { return track.trans.cols(); })
      .def("__repr__", [](const ObjectTrack& track) {
        return fmt::format("<holdfast.ObjectTrack: {}{} frames>",
                           track.name.empty() ? "" : track.name + ", ", track.trans.cols());
      });
}

// Copies the clip, since existing arrays and tracks point into the track of the original.
ClipPtr WithObject(const Clip& self, const py::object& track) {
  auto clip = std::make_shared<Clip>(self);
  clip->object.reset();
  if (track.is_none()) return clip;
  clip->object = track.cast<const ObjectTrack&>();
  RequireLength(clip->object->trans.cols(), clip->NumFrames(), "object");
  return clip;
}

template <typename Class>
void BindFields(Class& clip) {
  const auto columns = [&](const char* name, int first, int count, const char* doc) {
    clip.def_property_readonly(
        name,
        [=](const py::object& self) { return PoseColumns(self, 3 * first, 3 * (first + count)); },
        doc);
  };
  columns("poses", 0, kNumJoints, "(T, 165) axis-angle, radians; a view");
  columns("root_orient", 0, 1, "(T, 3), a view into poses");
  columns("pose_body", 1, 21, "(T, 63), a view into poses");
  columns("pose_jaw", kJaw, 1, "(T, 3), a view into poses");
  columns("pose_eye", kLeftEye, 2, "(T, 6), a view into poses");
  columns("pose_hand", kLeftHandBegin, 2 * kJointsPerHand,
          "(T, 90), left 45, right 45, a view into poses");
  clip.def_property_readonly(
      "trans", [](const py::object& self) { return RowsOf(self.cast<Clip&>().trans, self); },
      "(T, 3) meters: the pelvis is at J_0 + trans; a view");
  clip.def_property(
      "betas",
      [](const Clip& self) { return py::array_t<double>(self.betas.size(), self.betas.data()); },
      [](Clip& self, const py::object& value) { self.betas = Vector(value, "betas"); },
      "(B,) shape coefficients; a copy");
  clip.def_property_readonly(
      "object", [](Clip& self) { return self.object ? &*self.object : nullptr; },
      "ObjectTrack, or None");
  clip.def("with_object", &WithObject, "object"_a,
           R"(Copies the clip with another object.

Parameters
----------
object : ObjectTrack or None
    None removes the object.

Returns
-------
Clip
)");
  clip.def_property(
      "frame_rate", [](const Clip& self) { return self.frame_rate; },
      [](Clip& self, double value) { self.frame_rate = PositiveRate(value); }, "Hz");
  clip.def_property(
      "holding_hand",
      [](const Clip& self) {
        return py::array_t<std::uint8_t>(static_cast<py::ssize_t>(self.holding_hand.size()),
                                         self.holding_hand.data());
      },
      [](Clip& self, const py::object& value) {
        self.holding_hand = HoldingBits(value, self.NumFrames());
      },
      "(T,) or empty: 0 nobody, 1 right hand, 2 left, 3 both; a copy");
}

constexpr const char* kClipDoc =
    R"(A human motion in SMPL-X parameters, optionally with an object.

World: z up, ground z = 0, meters. Fields are AMASS's SMPL-X arrays. Those called views share
memory with the clip.

Parameters
----------
poses : array_like (T, 165) or (T, 55, 3)
    Axis-angle, radians. Also rotation matrices (T, 55, 3, 3), or 6D (T, 55, 6): the first two
    columns of the matrix, one after the other.
trans : array_like (T, 3)
    Meters.
betas : array_like (B,), optional
    Shape coefficients.
frame_rate : float, default 30.0
    Hz.
gender : str, default 'neutral'
model_type : str, default 'smplx'
object : ObjectTrack, optional
holding_hand : array_like (T,), optional
    0 nobody, 1 right hand, 2 left, 3 both.
)";

constexpr const char* kFromSmplxDoc =
    R"(Makes a clip from the arguments of smplx by name, as returned by to_smplx().

Missing joints and translation are zero. expression is ignored.

Parameters
----------
parameters : dict
    Arrays or tensors (T, ...). Hands are complete angles (T, 45); use import_motion for principal
    components and for angles relative to the mean hand. betas (T, B) are averaged.
frame_rate : float, default 30.0
    Hz.
gender : str, default 'neutral'
object : ObjectTrack, optional
holding_hand : array_like (T,), optional
    0 nobody, 1 right hand, 2 left, 3 both.

Returns
-------
Clip
)";

// Parameters of Clip.load and import_motion after the first.
constexpr const char* kImportDoc =
    R"(body : BodyModel, optional
    Body model of the motion; default: the embedded one.
frame_rate : float, optional
    Hz; 0: the file's. Default: the file's, but 30 for retargeted motion.
betas : array_like (B,), optional
    Shape of the body for motions with their own skeleton.
hand_models : list of path, optional
    SMPL-X or MANO files for hands stored as principal components.
@options

Returns
-------
Clip

Raises
------
Error
    If the file cannot be read as a motion.
)";

}  // namespace

void BindClip(py::module_& module) {
  BindTrack(module);
  ImportFileOptions usual;
  const std::string parameters = WithOptions(kImportDoc, OptionsOf(usual).Without({"fps"}));
  const std::string load_doc = R"(Loads a clip with the options of import_motion().

Parameters
----------
path : str or path
    Name of an embedded clip ('demo_drink'), result folder, or motion file.
)" + parameters;
  py::class_<Clip, ClipPtr> clip(module, "Clip", kClipDoc);
  clip.def(py::init(&MakeClip), "poses"_a, "trans"_a, py::kw_only(), "betas"_a = py::none(),
           "frame_rate"_a = 30.0, "gender"_a = "neutral", "model_type"_a = "smplx",
           "object"_a = py::none(), "holding_hand"_a = py::none());
  BindFields(clip);
  clip.def_readwrite("gender", &Clip::gender)
      .def_readwrite("model_type", &Clip::surface_model_type, "'smplx', 'smplh', ...")
      .def_readwrite("body_model", &Clip::body_model, "name of the body model of betas")
      .def_readwrite("subject", &Clip::subject)
      .def_readwrite("action", &Clip::action)
      .def("__len__", &Clip::NumFrames)
      .def("__getitem__", &SliceOf, "frames"_a, R"(Copies frames begin:end to a new clip.

Parameters
----------
frames : slice
    In steps of one frame.

Returns
-------
Clip
)")
      .def("__repr__",
           [](const Clip& self) {
             return fmt::format(
                 "<holdfast.Clip: {} frames at {:g} Hz{}>", self.NumFrames(), self.frame_rate,
                 self.object ? ", with " + (self.object->name.empty() ? std::string("an object")
                                                                      : self.object->name)
                             : "");
           })
      .def(
          "copy", [](const Clip& self) { return std::make_shared<Clip>(self); },
          R"(Copies the clip.

Returns
-------
Clip
)")
      .def(
          "resample",
          [](const Clip& self, double frame_rate) {
            if (!(frame_rate > 0.0)) throw py::value_error("frame_rate: expected more than 0 Hz");
            return std::make_shared<Clip>(
                RunAside([self, frame_rate] { return Resample(self, frame_rate); }));
          },
          "frame_rate"_a, R"(Resamples the clip to another frame rate.

Parameters
----------
frame_rate : float
    Hz.

Returns
-------
Clip
)")
      .def("to_smplx", &ToSmplx,
           R"(Returns the arguments of smplx's forward() by name.

Returns
-------
dict
    Arrays (T, ...) and betas (1, B), for a model created with use_pca=False, flat_hand_mean=True,
    batch_size=len(clip), num_betas=clip.betas.size.
)")
      .def_static("from_smplx", &FromSmplx, "parameters"_a, "frame_rate"_a = 30.0, py::kw_only(),
                  "gender"_a = "neutral", "object"_a = py::none(), "holding_hand"_a = py::none(),
                  kFromSmplxDoc)
      .def_static("load", &LoadAny, "path"_a, py::kw_only(), "body"_a = py::none(),
                  "frame_rate"_a = py::none(), "betas"_a = py::none(),
                  "hand_models"_a = std::vector<std::string>(), load_doc.c_str())
      .def(
          "save",
          [](const Clip& self, const std::filesystem::path& path, bool force) {
            RequireInRange(self, "Clip");
            RequireNew(path, force);
            RunAside([self, path] { WriteClip(self, path); });
          },
          "path"_a, py::kw_only(), "force"_a = false,
          R"(Writes AMASS's SMPL-X .npz, atomically, without the object's mesh.

Parameters
----------
path : path
force : bool, default False
    Overwrite an existing file.

Raises
------
Error
    If the file exists, unless force=True.
)");
  const std::string doc =
      R"(Imports a clip from a motion file.

Reads GRAB, AMASS, ARCTIC, Motion-X, smplx parameters, glTF, BVH, ASF/AMC, ... The format is
detected from the content. The mesh of the clip's object, which the file contains or references, is
clip.object.surface. Decisions made by the import are logged to 'holdfast' (INFO; WARNING if they
may be wrong, such as a frame rate that the file does not state).

Parameters
----------
path : path or dict
    File or folder, or the content of a file of parameters as a dict of arrays (or tensors) by the
    names in it.
)" + parameters;
  module.def("import_motion", &LoadAny, "path"_a, py::kw_only(), "body"_a = py::none(),
             "frame_rate"_a = py::none(), "betas"_a = py::none(),
             "hand_models"_a = std::vector<std::string>(), doc.c_str());
}

void RequireNew(const std::filesystem::path& path, bool force) {
  std::error_code ignored;
  if (force || !std::filesystem::exists(path, ignored)) return;
  throw Error(path.string(), "exists already", "Choose another name, or give force=True");
}

void LogNotes(const std::vector<std::string>& notes) {
  if (notes.empty()) return;
  const py::object logger = py::module_::import("logging").attr("getLogger")("holdfast");
  constexpr std::string_view kWarning = "warning: ";
  for (const std::string& text : notes) {
    const std::string note = PythonText(text);
    if (note.starts_with(kWarning)) {
      logger.attr("warning")("%s", note.substr(kWarning.size()));
    } else {
      logger.attr("info")("%s", note);
    }
  }
}

ClipArgument ClipOf(const py::handle& value, const py::object& model, const char* name,
                    ImportFileOptions options) {
  if (!py::isinstance<Clip>(value) && py::hasattr(value, "clip") &&
      py::isinstance<Clip>(value.attr("clip"))) {
    return ClipOf(value.attr("clip"), model, name, std::move(options));
  }
  ClipArgument argument;
  ModelPtr body = model.is_none() ? nullptr : model.cast<ModelPtr>();
  std::vector<std::string> notes;
  if (py::isinstance<Clip>(value)) {
    argument.clip = std::make_shared<Clip>(value.cast<const Clip&>());
    argument.name = name;
    RequireInRange(*argument.clip, name);
    if (std::string note = WrapJointAngles(*argument.clip); !note.empty()) {
      notes.push_back(std::move(note));
    }
    argument.body = BodyOfClip(name, *argument.clip, body ? body : BodyModel::Default(), notes);
  } else {
    if (!IsPath(value)) {
      throw py::type_error(
          fmt::format("{}: expected a Clip, a path or the name of an embedded clip, got {}", name,
                      TypeText(value)));
    }
    argument.name = py::str(value);
    LoadedClip loaded = Load(argument.name, model, std::move(options));
    argument.file = loaded.file;
    argument.imported = loaded.imported;
    if (loaded.change) argument.other_body = loaded.change->from;
    argument.clip = std::make_shared<Clip>(std::move(loaded.clip));
    argument.body = loaded.body;
  }
  LogNotes(notes);
  return argument;
}

LoadedClip LoadedOf(const ClipArgument& clip) {
  LoadedClip loaded;
  loaded.clip = *clip.clip;
  loaded.body = clip.body;
  loaded.file = clip.file;
  loaded.imported = clip.imported;
  if (!clip.other_body.empty()) loaded.change = BodyChange{clip.other_body, {0.0, 0.0, 0.0}};
  return loaded;
}

ClipObject OwnObject(const ClipArgument& clip, double scale) {
  const LoadedClip loaded = LoadedOf(clip);
  ClipObject own = RunAside([loaded, scale] { return FindClipObject(loaded, scale); });
  if (!own.warning.empty()) own.warning = fmt::format("warning: {}: {}", clip.name, own.warning);
  return own;
}

LoadedObject ObjectOf(const py::handle& value, const ClipArgument& clip, double scale) {
  if (!value.is_none()) return ObjectOf(value, scale);
  if (!clip.clip->object) {
    throw Error(clip.name, "has no object, and none is given", "Give one with object");
  }
  const ObjectTrack& track = *clip.clip->object;
  const ClipObject own = OwnObject(clip, scale);
  if (!own.mesh) {
    throw Error(clip.name, "its object's mesh is missing: " + own.missing, "Give it as object");
  }
  if (!own.warning.empty()) LogNotes({own.warning});
  std::string name =
      track.name.empty() ? std::filesystem::path(track.mesh).stem().string() : track.name;
  if (name.empty()) name = "object";
  const std::string source = track.mesh.empty() ? name : track.mesh;
  LoadedObject object =
      RunAside([own, name, source] { return ObjectOfMesh(*own.mesh, name, source); });
  LogNotes(object.notes);
  return object;
}

ClipPtr WithSurface(Clip clip, const TriangleMesh& mesh) {
  if (clip.object) clip.object->surface = std::make_shared<const TriangleMesh>(mesh);
  return std::make_shared<Clip>(std::move(clip));
}

}  // namespace holdfast::python
