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

namespace holdfast {

/// The value itself, where it was packed alone into a list or a numpy array of Python objects:
/// np.savez of a dict gives a 0-d array that holds it.
DataValue Unpacked(DataValue value);

/// Named values, of a whole file or of a dict in one: importers ask both the same way.
class Fields {
 public:
  /// `file` must outlive this.
  explicit Fields(const DataFile& file);
  explicit Fields(DataValue value);

  bool Has(std::string_view name) const;
  /// The first of `names` that is there.
  std::optional<std::string_view> FirstOf(std::span<const std::string_view> names) const;
  std::optional<DataValue> Find(std::string_view name) const;
  std::optional<DataValue> Find(std::span<const std::string_view> names) const;
  /// Throws Error when it is not there, listing what is.
  DataValue operator[](std::string_view name) const;
  /// The dict of that name.
  Fields In(std::string_view name) const { return Fields((*this)[name]); }
  std::vector<std::string> Names() const;
  const std::string& Where() const { return where_; }

 private:
  const DataFile* file_ = nullptr;  // of an .npz, whose members are read on demand
  std::optional<DataValue> value_;
  std::string where_;
};

/// The names in `fields` that are none of `used`, one text, empty without any: for what an importer
/// leaves out.
std::string UnusedNames(const Fields& fields, std::span<const std::string_view> used);

/// A text, empty when it is not there or no text.
std::string TextOf(const Fields& fields, std::string_view name);

/// "male", "female" or "neutral" of a text in any of the field's spellings or of IMoS's numbers (1
/// male, 2 female); nothing for all else.
std::optional<std::string> GenderOf(const DataValue& value);

/// The axis that points up in a file's world.
enum class WorldUp { kPlusX, kMinusX, kPlusY, kMinusY, kPlusZ, kMinusZ };

/// "y", "-y", ... and back; nothing for any other text.
std::string_view WorldUpName(WorldUp up);
std::optional<WorldUp> ParseWorldUp(std::string_view text);

/// Which hands of a file are wanted: those of the body, one alone (a MANO hand in the world, where
/// the file has it), or none (fingers left in the body model's relaxed hand).
enum class ImportedHands { kOfBody, kRightAlone, kLeftAlone, kNone };

/// What the user says where a file of body parameters does not.
struct ParameterOptions {
  /// For the pelvis that a root turns about, the mean hand, and what posture tells. ImportFile puts
  /// the embedded body here when there is none; the importers need one.
  std::shared_ptr<const BodyModel> body;
  /// SMPL-X or MANO files to take hand components and mean hands from; empty: none.
  std::vector<std::filesystem::path> hand_models;
  /// Whether finger angles are complete (true) or differences from the mean hand (false); empty:
  /// what the format is known for, then what the fingers look like.
  std::optional<bool> flat_hand_mean;
  std::optional<WorldUp> up;        ///< empty: what the format is known for, else by the posture
  double source_frame_rate = 0;     ///< Hz, for files that do not tell; 0: the format's
  double meters_per_unit = 1;       ///< of positions, where a file is not in meters
  std::filesystem::path data_root;  ///< folder of the data set (GRAB's: with `tools` in it)
  ImportedHands hands = ImportedHands::kOfBody;
  bool find_ground = true;  ///< where a format has its floor anywhere: move it to z = 0
  int person = 0;           ///< of a folder with several people a frame
};

/// How far matrices that stand for rotations were from being rotations.
struct RotationDefects {
  int matrices = 0;  ///< how many were read; 0: the file has axis-angle
  int bad = 0;       ///< with a singular value off one by more than kRotationTolerance
  int frames = 0;    ///< with any such matrix
  int first_frame = -1;
  int reflections = 0;  ///< with a negative determinant
  int worst_frame = -1;
  double largest_off = 0;  ///< of any singular value from one
  double min_singular = 1, max_singular = 1;
  double min_determinant = 1, max_determinant = 1;
};

/// A clip made of a file of parameters, and all that was decided on the way.
struct ImportedClip {
  Clip clip;
  std::string format;                    ///< "GRAB sequence"
  std::vector<std::string> conventions;  ///< what the file's are, and what was done about them
  std::vector<std::string> notes;        ///< what a user would want to know before going on
  std::vector<std::string> dropped;      ///< fields that a clip has no place for
  /// Where the object's and the table's mesh lie; empty when not found or not named.
  std::filesystem::path object_mesh, table_mesh;
  std::optional<TriangleMesh> object_surface;  ///< the object's, where the file itself holds it
  std::optional<TexturedMesh> object_look;     ///< of that surface, where the file gives one
  double object_mesh_scale = 1;                ///< meters per unit of that mesh
  RotationDefects object_defects, body_defects;
};

}  // namespace holdfast
