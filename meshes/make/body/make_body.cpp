// SPDX-License-Identifier: MIT
//
// make_body OUT.npz: makes the body that comes with Holdfast. The same bytes on every run.

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "geometry/body/rest_pelvis.h"
#include "geometry/io/container/npz.h"
#include "meshes/make/body/body_betas.h"
#include "meshes/make/body/body_correctives.h"
#include "meshes/make/body/body_mesh.h"
#include "meshes/make/body/body_skinning.h"
#include "meshes/make/body/hand_mean.h"
#include "meshes/make/body/joint_regressor.h"

namespace holdfast {
namespace {

constexpr std::size_t kNumExpressions = 10;  // zeros: the face of the body does not move

std::vector<float> RowMajor(const Eigen::MatrixXd& matrix) {
  std::vector<float> values;
  values.reserve(static_cast<std::size_t>(matrix.size()));
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      values.push_back(static_cast<float>(matrix(i, j)));
    }
  }
  return values;
}

/// The surface, which is made with the pelvis at the origin, with the pelvis in its place. Across
/// the body, and where it goes to, on a grid of 2^-24 m, so that left and right still mirror each
/// other exactly in float32.
Eigen::MatrixXd Template(const BodyMesh& body) {
  const auto on_grid = [](double x) { return std::nearbyint(x * 0x1p24) * 0x1p-24; };
  Eigen::MatrixXd vertices = body.mesh.vertices.transpose();
  vertices.col(0) = vertices.col(0).unaryExpr(on_grid).eval();
  vertices.rowwise() += kEmbeddedRestPelvis.unaryExpr(on_grid).transpose();
  return vertices;
}

/// V x 3 x 20, C order.
std::vector<float> ShapeDirs(const std::array<Eigen::Matrix3Xd, kNumBetas>& directions) {
  std::vector<float> values;
  for (Eigen::Index i = 0; i < directions[0].cols(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const Eigen::Matrix3Xd& direction : directions) {
        // Below a micrometre there is no effect.
        const double value = direction(axis, i);
        values.push_back(std::abs(value) < 1e-6 ? 0.0f : static_cast<float>(value));
      }
      values.insert(values.end(), kNumExpressions, 0.0f);
    }
  }
  return values;
}

std::vector<std::int64_t> KinematicTree() {
  std::vector<std::int64_t> table;
  for (const int parent : kJointParents) table.push_back(parent < 0 ? 4294967295 : parent);
  for (int j = 0; j < kNumJoints; ++j) table.push_back(j);
  return table;
}

std::vector<std::int64_t> AsInt64(const std::vector<int>& ids) { return {ids.begin(), ids.end()}; }

void WriteBody(const char* path) {
  const BodyShape shape;
  const BodyMesh body = MeshBody(shape);
  const Eigen::MatrixXd weights = SkinningWeights(body);
  const Eigen::MatrixXd regressor = JointRegressor(body, weights);

  const std::size_t num_vertices = static_cast<std::size_t>(body.mesh.NumVertices());
  const std::size_t num_faces = static_cast<std::size_t>(body.mesh.NumFaces());
  constexpr std::size_t kJoints = kNumJoints;
  NpzWriter writer;
  writer.AddFloat32("v_template", {num_vertices, 3}, RowMajor(Template(body)));
  std::vector<std::uint32_t> faces(body.mesh.faces.data(),
                                   body.mesh.faces.data() + body.mesh.faces.size());
  writer.AddUint32("f", {num_faces, 3}, std::move(faces));
  writer.AddFloat16("shapedirs", {num_vertices, 3, kNumBetas + kNumExpressions},
                    ShapeDirs(ShapeDirections(body, weights)));
  writer.AddFloat16("posedirs", {num_vertices, 3, 9 * (kJoints - 1)},
                    PoseCorrectives(body, weights));
  writer.AddFloat32("J_regressor", {kJoints, num_vertices}, RowMajor(regressor));
  writer.AddFloat32("weights", {num_vertices, kJoints}, RowMajor(weights));
  writer.AddInt64("kintree_table", {2, kJoints}, KinematicTree());
  std::vector<float> identity(kHandDofs * kHandDofs, 0.0f);
  for (std::size_t k = 0; k < kHandDofs; ++k) identity[k * (kHandDofs + 1)] = 1.0f;
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const std::string suffix = side == Side::kLeft ? "l" : "r";
    const auto mean = RelaxedHand(side);
    writer.AddFloat32("hands_mean" + suffix, {kHandDofs}, {mean.begin(), mean.end()});
    writer.AddFloat32("hands_components" + suffix, {kHandDofs, kHandDofs}, identity);
    const std::vector<int> ids = HandVertices(body, side);
    writer.AddInt64(std::string(SideName(side)) + "_hand_vertex_ids", {ids.size()}, AsInt64(ids));
    std::printf("%s hand: %zu vertices\n", std::string(SideName(side)).c_str(), ids.size());
  }
  writer.Write(path);
  std::printf("%zu vertices (%d on the midline), %zu faces\n", num_vertices, body.num_midline,
              num_faces);
}

}  // namespace
}  // namespace holdfast

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_body OUT.npz\n");
    return 2;
  }
  try {
    holdfast::WriteBody(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_body: %s\n", error.what());
    return 1;
  }
  return 0;
}
