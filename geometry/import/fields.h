// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/io/mesh/textured_mesh.h"
#include "geometry/io/pickle/data_file.h"
#include "geometry/retarget/retarget.h"

namespace holdfast {

/// Returns the value itself if it was packed alone into a list or a numpy array of Python objects:
/// np.savez of a dict gives a 0-d array that holds the dict.
DataValue Unpacked(DataValue value);

/// Named values of a whole file or of a dict in a file, with one interface for importers.
class Fields {
 public:
  /// `file` must outlive this.
  explicit Fields(const DataFile& file);
  explicit Fields(DataValue value);

  bool Has(std::string_view name) const;
  /// Returns the first of `names` that exists.
  std::optional<std::string_view> FirstOf(std::span<const std::string_view> names) const;
  std::optional<DataValue> Find(std::string_view name) const;
  std::optional<DataValue> Find(std::span<const std::string_view> names) const;
  /// Throws Error that lists the existing names if `name` does not exist.
  DataValue operator[](std::string_view name) const;
  /// Returns the dict of that name.
  Fields In(std::string_view name) const { return Fields((*this)[name]); }
  std::vector<std::string> Names() const;
  const std::string& Where() const { return where_; }

 private:
  const DataFile* file_ = nullptr;  // of an .npz, whose members are read on demand
  std::optional<DataValue> value_;
  std::string where_;
};

/// Returns a text; empty if it does not exist, is not a text, or has control characters.
std::string TextOf(const Fields& fields, std::string_view name);

/// Returns "male", "female" or "neutral" for a text in any common spelling and for IMoS's numbers
/// (1 male, 2 female); nullopt for anything else.
std::optional<std::string> GenderOf(const DataValue& value);

/// Which hands of a file to import: those of the body, one alone (a MANO hand in the world, if the
/// file has it), or none (fingers keep the body model's relaxed hand).
enum class ImportedHands { kOfBody, kRightAlone, kLeftAlone, kNone };

/// What the user specifies about a file of any kind that does not state it.
struct FileFacts {
  std::optional<double> source_frame_rate;  ///< Hz; empty: the format's usual one
  std::optional<double> meters_per_unit;    ///< of positions; empty: the format's convention
  std::optional<UpAxis> up;  ///< empty: by the format's convention, else by the posture
  bool keep_ground = false;  ///< do not move the floor to z = 0
  std::string prop;          ///< the object to use of a scene with several; empty: chosen
};

/// What the user specifies where a file of body parameters does not.
struct ParameterOptions : FileFacts {
  /// Supplies the pelvis that a root rotates about and the mean hand, and is used to judge the
  /// posture. ImportFile sets the embedded body if this is null; the importers need one.
  std::shared_ptr<const BodyModel> body;
  /// SMPL-X or MANO files that supply hand components and mean hands; empty: none.
  std::vector<std::filesystem::path> hand_models;
  /// Whether finger angles are complete (true) or differences from the mean hand (false); empty: by
  /// the convention of the format, else judged from the fingers.
  std::optional<bool> flat_hand_mean;
  std::string data_root;  ///< root of the data set (GRAB: contains `tools`)
  ImportedHands hands = ImportedHands::kOfBody;
  int person = 0;  ///< which one in a folder with several people per frame
};

/// How far matrices that represent rotations are from being rotations.
struct RotationDefects {
  int matrices = 0;  ///< number of matrices read; 0: the file has axis-angle
  int bad = 0;       ///< with a singular value off one by more than 1e-3
  int frames = 0;    ///< frames with a bad matrix
  int first_frame = -1;
  int reflections = 0;  ///< matrices with a negative determinant
  int worst_frame = -1;
  double largest_off = 0;  ///< largest deviation of a singular value from one
  double min_singular = 1, max_singular = 1;
  double min_determinant = 1, max_determinant = 1;
};

/// When a wrist is at the goal of a motion to a goal (CIRCLE).
struct GoalFrame {
  int frame = 0;
  Side wrist = Side::kRight;
};

/// A clip made from a file of parameters, and the decisions made on the way.
struct ImportedClip {
  Clip clip;
  std::optional<GoalFrame> goal;         ///< if the file has one
  std::string format;                    ///< "GRAB sequence"
  std::vector<std::string> conventions;  ///< conventions of the file, and how they were handled
  std::vector<std::string> notes;        ///< what a user should know before using the clip
  std::vector<std::string> dropped;      ///< fields that a clip cannot store
  /// Paths of the object's and the table's mesh; empty if not found or not named.
  std::filesystem::path object_mesh, table_mesh;
  std::optional<TriangleMesh> object_surface;  ///< the object's, if the file itself holds it
  std::optional<TexturedMesh> object_look;     ///< of that surface, if the file has one
  double object_mesh_scale = 1;                ///< meters per unit of that mesh
  RotationDefects object_defects, body_defects;
};

/// Adds the names in `fields` that are not in `used`, as one text, to those that are dropped.
void DropUnused(const Fields& fields, std::span<const std::string_view> used,
                ImportedClip& imported);

}  // namespace holdfast
