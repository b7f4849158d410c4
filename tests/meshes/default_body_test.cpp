// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include <gtest/gtest.h>

#include "geometry/body/body_model.h"
#include "geometry/body/skeleton.h"
#include "tests/meshes/self_intersection.h"

namespace holdfast {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Matrix3Xi;
using Eigen::Vector3d;

constexpr double kDegrees = std::numbers::pi / 180.0;
constexpr std::array<const char*, 5> kFingerNames = {"index", "middle", "pinky", "ring", "thumb"};

const BodyModel& Model() {
  static const std::shared_ptr<const BodyModel> model = BodyModel::Default();
  return *model;
}
const BodySurface& Surface() {
  static const BodySurface surface(BodyModel::Default(), Eigen::VectorXd{});
  return surface;
}

/// x of the plane that left and right mirror each other at: the first vertices lie on it.
double MirrorPlane() { return Model().Template()(0, 0); }
int NumMidline() {
  return static_cast<int>((Model().Template().row(0).array() == MirrorPlane()).count());
}
/// Vertices of either side: those of the left come next, then their mirror images in that order.
int NumSide() { return (Model().NumVertices() - NumMidline()) / 2; }
Matrix3Xd Shaped(int beta, double value) {
  return Model().ShapedVertices(value * Eigen::VectorXd::Unit(10, beta));
}
Vector3d Mirrored(const Vector3d& point) {
  return {2 * MirrorPlane() - point.x(), point.y(), point.z()};
}

Matrix3Xd Posed(const JointPose& pose) {
  BodyState state;
  Forward(Surface(), pose, Vector3d::Zero(), state);
  return state.vertices;
}

/// Axis about which a finger of the left hand curls at its k-th joint.
Vector3d FlexionAxis(int finger, int k) {
  const int joint = kLeftHandBegin + 3 * finger + k;
  const Matrix3Xd& joints = Surface().RestJoints();
  const int from = k < 2 ? joint : joint - 1;
  const Vector3d bone = joints.col(from + 1) - joints.col(from);
  const Vector3d palmar = finger == 4 ? Vector3d(0.35, -0.62, -0.70) : Vector3d(0, -1, 0);
  return bone.cross(palmar).normalized();
}

/// The pose with one joint of a finger, or with k < 0 the whole finger, curled on both hands.
void Curl(int finger, int k, double degrees, JointPose& pose) {
  for (int segment = 0; segment < 3; ++segment) {
    if (k >= 0 && segment != k) continue;
    const Vector3d w = degrees * kDegrees * FlexionAxis(finger, segment);
    const int joint = kLeftHandBegin + 3 * finger + segment;
    pose.col(joint) = w;
    pose.col(MirrorJoint(joint)) = Vector3d(w.x(), -w.y(), -w.z());
  }
}

double WeightOnFinger(int vertex, Side side, int finger) {
  const int begin = HandBegin(side) + 3 * finger;
  double sum = 0;
  for (const auto& [joint, value] : Surface().Weights(vertex)) {
    if (joint >= begin && joint < begin + 3) sum += value;
  }
  return sum;
}

/// Volume of the vertices that belong mostly to a finger, the cut closed by a fan about its center.
double FingerVolume(const Matrix3Xd& vertices, Side side, int finger) {
  std::map<std::pair<int, int>, int> open;
  double six_volumes = 0;
  const Matrix3Xi& faces = Model().Faces();
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    const Eigen::Vector3i face = faces.col(f);
    if (!std::all_of(face.begin(), face.end(),
                     [&](int v) { return WeightOnFinger(v, side, finger) > 0.5; })) {
      continue;
    }
    six_volumes += vertices.col(face[0]).dot(vertices.col(face[1]).cross(vertices.col(face[2])));
    for (int c = 0; c < 3; ++c) {
      const int a = face[c], b = face[(c + 1) % 3];
      if (open.erase({b, a}) == 0) open[{a, b}] = 1;
    }
  }
  Vector3d center = Vector3d::Zero();
  for (const auto& [edge, count] : open) center += vertices.col(edge.first);
  center /= static_cast<double>(open.size());
  for (const auto& [edge, count] : open) {
    six_volumes += center.dot(vertices.col(edge.second).cross(vertices.col(edge.first)));
  }
  return six_volumes / 6.0;
}

TEST(DefaultBody, HasTheSizeItPromises) {
  EXPECT_GE(Model().NumVertices(), 8000);
  EXPECT_LE(Model().NumVertices(), 12000);
  EXPECT_EQ(Model().NumShape() + Model().NumExpression(), 20);
  for (const Side side : {Side::kLeft, Side::kRight}) {
    EXPECT_GE(Model().HandVertexIds(side).size(), 700u);
    EXPECT_LE(Model().HandVertexIds(side).size(), 1000u);
  }
  const Matrix3Xd& v = Model().Template();
  EXPECT_NEAR(v.row(1).maxCoeff() - v.row(1).minCoeff(), 1.66, 0.01);
}

TEST(DefaultBody, IsOneClosedSphereFacingOutwards) {
  const Matrix3Xi& faces = Model().Faces();
  std::set<std::pair<int, int>> directed;
  std::vector<int> parent(Model().NumVertices());
  for (int i = 0; i < Model().NumVertices(); ++i) parent[i] = i;
  const auto root = [&](int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const int a = faces(c, f), b = faces((c + 1) % 3, f);
      EXPECT_TRUE(directed.emplace(a, b).second) << "edge " << a << " " << b << " used twice";
      parent[root(a)] = root(b);
    }
  }
  for (const auto& [a, b] : directed) ASSERT_TRUE(directed.contains({b, a}));
  for (int i = 1; i < Model().NumVertices(); ++i) ASSERT_EQ(root(i), root(0));
  // Euler characteristic 2: genus 0.
  EXPECT_EQ(Model().NumVertices() - static_cast<int>(directed.size()) / 2 +
                static_cast<int>(faces.cols()),
            2);
  const double volume = SignedVolume({Model().Template(), faces});
  EXPECT_GT(volume, 0.045);
  EXPECT_LT(volume, 0.080);
}

TEST(DefaultBody, HasWellShapedTriangles) {
  const Matrix3Xd& v = Model().Template();
  const Matrix3Xi& faces = Model().Faces();
  double smallest = 180;
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const Vector3d p = v.col(faces(c, f));
      const Vector3d a = v.col(faces((c + 1) % 3, f)) - p, b = v.col(faces((c + 2) % 3, f)) - p;
      smallest = std::min(smallest, std::atan2(a.cross(b).norm(), a.dot(b)) / kDegrees);
    }
  }
  EXPECT_GT(smallest, 15.0);
}

TEST(DefaultBody, MirrorsItselfVertexByVertex) {
  const Matrix3Xd& v = Model().Template();
  const int num_midline = NumMidline(), num_side = NumSide();
  ASSERT_EQ(num_midline, 166);
  ASSERT_EQ(num_midline + 2 * num_side, Model().NumVertices());
  for (int i = 0; i < num_midline; ++i) ASSERT_EQ(v(0, i), MirrorPlane());
  for (int i = num_midline; i < num_midline + num_side; ++i) {
    const int other = i + num_side;
    ASSERT_GT(v(0, i), MirrorPlane());
    ASSERT_LT((v.col(other) - Mirrored(v.col(i))).norm(), 1e-6);
    const auto left = Surface().Weights(i);
    const auto right = Surface().Weights(other);
    ASSERT_EQ(left.size(), right.size());
    for (const auto& [joint, value] : left) {
      const auto match = std::find_if(
          right.begin(), right.end(),
          [&, j = joint](const auto& candidate) { return candidate.first == MirrorJoint(j); });
      ASSERT_NE(match, right.end());
      ASSERT_NEAR(match->second, value, 1e-6);
    }
  }
}

TEST(DefaultBody, StandsOnFlatFeet) {
  const Matrix3Xd& v = Model().Template();
  const double sole = v.row(1).minCoeff();
  int left = 0, right = 0;
  for (Eigen::Index i = 0; i < v.cols(); ++i) {
    if (v(1, i) < sole + 0.0015) ++(v(0, i) > MirrorPlane() ? left : right);
  }
  EXPECT_GT(left, 30);
  EXPECT_EQ(left, right);
}

TEST(DefaultBody, WeightsAreAPartitionOverFourJoints) {
  for (int i = 0; i < Model().NumVertices(); ++i) {
    const auto weights = Surface().Weights(i);
    ASSERT_LE(weights.size(), 4u);
    double sum = 0;
    for (const auto& [joint, value] : weights) {
      ASSERT_GE(value, 0);
      sum += value;
    }
    ASSERT_NEAR(sum, 1.0, 1e-6);
  }
}

TEST(DefaultBody, FingersDoNotPullTheirNeighbors) {
  for (const int i : Model().HandVertexIds(Side::kLeft)) {
    for (int finger = 0; finger < 5; ++finger) {
      // Past the web (the far half of the first segment) a vertex belongs to one finger alone.
      double beyond_base = 0, others = 0;
      for (const auto& [joint, value] : Surface().Weights(i)) {
        const int in_hand = joint - kLeftHandBegin;
        if (in_hand < 0) continue;
        if (in_hand / 3 != finger) {
          others += value;
        } else if (in_hand % 3 > 0) {
          beyond_base += value;
        }
      }
      ASSERT_FALSE(beyond_base > 0.01 && others > 0.01) << "vertex " << i;
    }
  }
}

TEST(DefaultBody, JointsLieWhereTheSkeletonPutsThem) {
  const Matrix3Xd joints = Model().RestJoints(Model().Template());
  const auto expect_at = [&](std::string_view name, double x, double y, double z) {
    const Vector3d from_pelvis = joints.col(*FindJoint(name)) - joints.col(0);
    EXPECT_LT((from_pelvis - Vector3d(x, y, z)).norm(), 1e-4) << name;
  };
  expect_at("pelvis", 0, 0, 0);
  expect_at("head", 0, 0.6250, 0.0150);
  expect_at("left_knee", 0.1180, -0.4080, -0.0060);
  expect_at("right_knee", -0.1180, -0.4080, -0.0060);
  expect_at("left_wrist", 0.6508, 0.4462, 0.0050);
  expect_at("left_index1", 0.7338, 0.4442, 0.0295);
  expect_at("right_thumb1", -0.6718, 0.4372, 0.0270);
  for (int j = 0; j < kNumJoints; ++j) {
    const Vector3d mirrored = Mirrored(joints.col(j));
    EXPECT_LT((joints.col(MirrorJoint(j)) - mirrored).norm(), 1e-6) << kJointNames[j];
  }
}

// The published mean shape's, to the places that are known of it: code for SMPL-X, which has joint
// 0 at J_0 + trans with that J_0, puts the embedded body where its clips have it.
TEST(DefaultBody, RestsItsPelvisWhereSmplxDoes) {
  const Vector3d pelvis = Model().RestJoints(Model().Template()).col(0);
  EXPECT_LT((pelvis - Vector3d(0.0031, -0.3514, 0.0120)).norm(), 1e-6);
  EXPECT_LT((pelvis - kEmbeddedRestPelvis).norm(), 1e-6);
  for (int k = 0; k < 10; ++k) {
    EXPECT_LT((Model().RestJoints(Shaped(k, 2.0)).col(0) - pelvis).norm(), 0.003) << "beta " << k;
  }
}

TEST(DefaultBody, EveryShapeCoefficientIsVisibleAndSymmetric) {
  const Matrix3Xd& mean = Model().Template();
  const int num_midline = NumMidline(), num_side = NumSide();
  for (int k = 0; k < 10; ++k) {
    const Matrix3Xd move = Shaped(k, 1.0) - mean;
    EXPECT_GT(move.colwise().norm().maxCoeff(), 0.003) << "beta " << k;
    EXPECT_LT(move.colwise().norm().maxCoeff(), 0.080) << "beta " << k;
    for (int i = num_midline; i < num_midline + num_side; ++i) {
      const Vector3d mirrored(-move(0, i), move(1, i), move(2, i));
      ASSERT_LT((move.col(i + num_side) - mirrored).norm(), 1e-6);
    }
  }
}

TEST(DefaultBody, ShapeCoefficientsDoWhatTheyAreNamedFor) {
  const auto distance = [](const Matrix3Xd& j, std::string_view a, std::string_view b) {
    return (j.col(*FindJoint(a)) - j.col(*FindJoint(b))).norm();
  };
  const Matrix3Xd mean = Model().RestJoints(Model().Template());
  // Ratio of a bone's length at +2 to the mean.
  const auto growth = [&](int beta, std::string_view a, std::string_view b) {
    return distance(Model().RestJoints(Shaped(beta, 2.0)), a, b) / distance(mean, a, b);
  };
  EXPECT_NEAR(growth(0, "left_knee", "left_ankle"), 1.072, 0.005);     // height
  EXPECT_NEAR(growth(1, "left_knee", "left_ankle"), 1.0, 0.01);        // weight
  EXPECT_GT(growth(2, "left_shoulder", "right_shoulder"), 1.05);       // shoulders
  EXPECT_NEAR(growth(3, "left_hip", "left_knee"), 1.08, 0.02);         // legs
  EXPECT_LT(growth(3, "pelvis", "neck"), 0.97);                        // against trunk
  EXPECT_NEAR(growth(4, "left_elbow", "left_wrist"), 1.09, 0.02);      // arms
  EXPECT_NEAR(growth(5, "left_wrist", "left_middle1"), 1.11, 0.02);    // hands
  EXPECT_NEAR(growth(6, "left_middle1", "left_middle2"), 1.13, 0.03);  // fingers
  EXPECT_NEAR(growth(6, "left_wrist", "left_middle1"), 1.0, 0.02);
  EXPECT_GT(growth(7, "left_hip", "right_hip"), 1.05);           // hips
  EXPECT_GT(growth(8, "left_eye", "right_eye"), 1.05);           // head
  EXPECT_NEAR(growth(9, "left_knee", "left_ankle"), 1.0, 0.01);  // muscle
}

TEST(DefaultBody, DoesNotIntersectItselfAtRestNorWithExtremeShapes) {
  const Matrix3Xi& faces = Model().Faces();
  EXPECT_FALSE(CutsItself({Model().Template(), faces}));
  for (const double value : {-3.0, 3.0}) {
    for (int k = 0; k < 10; ++k) {
      const Matrix3Xd shaped = Shaped(k, value);
      EXPECT_GT(SignedVolume({shaped, faces}), 0.03);
      // The full test takes a third of a second a mesh: done for the coefficients that move skin
      // against skin (weight, fingers, hips, muscle).
      if (k == 1 || k == 6 || k == 7 || k == 9) {
        EXPECT_FALSE(CutsItself({shaped, faces})) << "beta " << k << " = " << value;
      }
    }
  }
}

TEST(DefaultBody, BentFingersKeepTheirVolume) {
  JointPose fist = JointPose::Zero();
  for (int finger = 0; finger < 5; ++finger) Curl(finger, -1, 80, fist);
  const Matrix3Xd all = Posed(fist);
  for (int finger = 0; finger < 5; ++finger) {
    const double rest = FingerVolume(Model().Template(), Side::kLeft, finger);
    ASSERT_GT(rest, 5e-6);
    EXPECT_NEAR(FingerVolume(Model().Template(), Side::kRight, finger), rest, 1e-9);
    EXPECT_GT(FingerVolume(all, Side::kLeft, finger), 0.85 * rest) << kFingerNames[finger];
    EXPECT_LT(FingerVolume(all, Side::kLeft, finger), 1.15 * rest) << kFingerNames[finger];
    EXPECT_GT(FingerVolume(all, Side::kRight, finger), 0.85 * rest) << kFingerNames[finger];
    for (int k = 0; k < 3; ++k) {
      JointPose pose = JointPose::Zero();
      Curl(finger, k, 80, pose);
      const double bent = FingerVolume(Posed(pose), Side::kLeft, finger);
      EXPECT_GT(bent, 0.9 * rest) << kFingerNames[finger] << " joint " << k;
      EXPECT_LT(bent, 1.1 * rest) << kFingerNames[finger] << " joint " << k;
    }
  }
}

TEST(DefaultBody, SingleBentJointsDoNotFoldTheSkin) {
  const BodySurface hand(BodyModel::Default(), Eigen::VectorXd{},
                         Model().HandVertexIds(Side::kLeft));
  BodyState state;
  for (int finger = 0; finger < 5; ++finger) {
    for (int k = 0; k < 3; ++k) {
      JointPose pose = JointPose::Zero();
      Curl(finger, k, 45, pose);
      Forward(hand, pose, Vector3d::Zero(), state);
      EXPECT_FALSE(CutsItself({state.vertices, hand.Faces()}))
          << kFingerNames[finger] << " joint " << k;
    }
  }
}

TEST(DefaultBody, BentElbowsAndKneesKeepTheirVolume) {
  const double rest = SignedVolume({Model().Template(), Model().Faces()});
  for (const auto& [name, axis] : {std::pair<std::string_view, Vector3d>{"left_elbow", {0, -1, 0}},
                                   {"right_elbow", {0, 1, 0}},
                                   {"left_knee", {1, 0, 0}},
                                   {"left_shoulder", {0, 0, -0.8}},
                                   {"left_hip", {-1, 0, 0}},
                                   {"right_wrist", {0, 0, 0.7}}}) {
    JointPose pose = JointPose::Zero();
    pose.col(*FindJoint(name)) = 90 * kDegrees * axis;
    EXPECT_NEAR(SignedVolume({Posed(pose), Model().Faces()}), rest, 0.02 * rest) << name;
  }
}

TEST(DefaultBody, MirroredPosesGiveMirroredBodies) {
  std::srand(7);
  const JointPose pose = 0.5 * JointPose::Random();
  const Matrix3Xd body = Posed(pose);
  const Matrix3Xd mirrored = Posed(MirrorPose(pose));
  const int num_midline = NumMidline(), num_side = NumSide();
  for (int i = 0; i < num_midline + num_side; ++i) {
    const int other = i < num_midline ? i : i + num_side;
    ASSERT_LT((body.col(i) - Mirrored(mirrored.col(other))).norm(), 1e-5) << "vertex " << i;
  }
}

TEST(DefaultBody, FingersStandApartAtRest) {
  const Matrix3Xd& v = Model().Template();
  // Vertices of the outer two segments of each finger.
  std::array<std::vector<int>, 5> outer;
  for (const int i : Model().HandVertexIds(Side::kLeft)) {
    for (const auto& [joint, value] : Surface().Weights(i)) {
      const int in_hand = joint - kLeftHandBegin;
      if (in_hand >= 0 && in_hand % 3 > 0 && value > 0.5) outer[in_hand / 3].push_back(i);
    }
  }
  for (int a = 0; a < 5; ++a) {
    for (int b = 0; b < a; ++b) {
      double gap = 1;
      for (const int i : outer[a]) {
        for (const int j : outer[b]) gap = std::min(gap, (v.col(i) - v.col(j)).norm());
      }
      EXPECT_GT(gap, 0.005) << kFingerNames[a] << " and " << kFingerNames[b];
    }
  }
}

TEST(DefaultBody, RelaxedHandsAreCurledAndMirrored) {
  const auto& left = Model().HandMean(Side::kLeft);
  const auto& right = Model().HandMean(Side::kRight);
  for (int k = 0; k < kJointsPerHand; ++k) {
    EXPECT_NEAR(left[3 * k], right[3 * k], 1e-6);
    EXPECT_NEAR(left[3 * k + 1], -right[3 * k + 1], 1e-6);
    EXPECT_NEAR(left[3 * k + 2], -right[3 * k + 2], 1e-6);
    if (k < 12) {
      EXPECT_GT(right[3 * k + 2], 5 * kDegrees);
    }
  }
  const Matrix3Xd relaxed = Posed(AddHandMean(Model(), JointPose::Zero()));
  EXPECT_FALSE(CutsItself({relaxed, Model().Faces()}));
}

}  // namespace
}  // namespace holdfast
