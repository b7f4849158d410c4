// SPDX-License-Identifier: MIT
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <random>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/mesh/surface_distance.h"
#include "geometry/object/load_object.h"
#include "geometry/robot/reader_process.h"
#include "geometry/robot/robot_file.h"
#include "geometry/robot/robot_hand.h"
#include "geometry/robot/robot_kinematics.h"
#include "geometry/rotation.h"
#include "solver/robot/finger_choice.h"
#include "solver/robot/human_demonstration.h"
#include "solver/robot/robot_anatomy.h"
#include "solver/robot/robot_measures.h"
#include "solver/robot/robot_solver.h"
#include "solver/robot/robot_terms.h"
#include "solver/trial/trial_scene.h"
#include "solver/unknowns/rotation_manifold.h"
#include "tests/support/error_text.h"
#include "tests/support/numeric_jacobian.h"
#include "tests/support/robot_files.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using testing::BoxHand;
using ::testing::ElementsAre;
using testing::ErrorText;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

RobotHand Read(const BoxHand& hand) {
  const TemporaryFolder folder;
  hand.Write(folder / "hand.urdf");
  return ReadRobotHand(folder / "hand.urdf");
}

std::string WhatReadingSays(const std::string& text, const std::string& name = "hand.urdf") {
  const TemporaryFolder folder;
  std::ofstream(folder / name) << text;
  return ErrorText([&] { FindAnatomy(ReadRobotHand(folder / name)); });
}

Eigen::VectorXd RandomNumbers(const RobotHand& hand, std::mt19937& random) {
  Eigen::VectorXd q(hand.NumDofs());
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int k = 0; k < hand.NumDofs(); ++k) {
    q(k) = hand.dofs[k].low + share(random) * (hand.dofs[k].high - hand.dofs[k].low);
  }
  return q;
}

TEST(RobotKinematics, JacobiansAreTheDerivatives) {
  const RobotHand hand = Read({.coupled = true});
  std::mt19937 random(3);
  RobotState state(hand);
  for (int trial = 0; trial < 5; ++trial) {
    const Eigen::VectorXd q = RandomNumbers(hand, random);
    for (int link = 0; link < hand.NumLinks(); ++link) {
      const Eigen::Vector3d in_link(0.01, -0.02, 0.03);
      state.Evaluate(q);
      const Eigen::Matrix3Xd J = state.PointJacobian(link, state.RootFromLink(link) * in_link);
      for (int k = 0; k < hand.NumDofs(); ++k) {
        const auto at = [&](double step) {
          state.Evaluate(q + step * Eigen::VectorXd::Unit(hand.NumDofs(), k));
          return Eigen::Vector3d(state.RootFromLink(link) * in_link);
        };
        EXPECT_TRUE(J.col(k).isApprox((at(1e-6) - at(-1e-6)) / 2e-6, 1e-7) ||
                    (J.col(k) - (at(1e-6) - at(-1e-6)) / 2e-6).norm() < 1e-9);
      }
    }
  }
}

TEST(RobotJoints, FollowersTurnWithTheirLeaderAndNarrowItsBounds) {
  const RobotHand hand = Read({.coupled = true});
  EXPECT_EQ(hand.NumDofs(), 10);  // five fingers, two each
  const int leader = hand.FindLink("digit_0_1"), follower = hand.FindLink("digit_0_2");
  EXPECT_EQ(hand.links[leader].dof, hand.links[follower].dof);
  EXPECT_DOUBLE_EQ(hand.links[follower].factor, 0.7);
  const RobotDof& dof = hand.dofs[hand.links[leader].dof];
  EXPECT_DOUBLE_EQ(dof.low, -0.1);  // the follower would allow -0.15 / 0.7
  EXPECT_DOUBLE_EQ(dof.high, 1.6);
}

TEST(RobotAnatomy, FindsFingersThumbSideAndPads) {
  for (const bool left : {false, true}) {
    for (const int fingers : {2, 3, 4}) {
      const RobotHand hand = Read({.fingers = fingers, .left = left, .coupled = fingers == 3});
      const RobotAnatomy anatomy = FindAnatomy(hand);
      SCOPED_TRACE(fmt::format("{} fingers, {}", fingers, left));
      ASSERT_EQ(anatomy.fingers.size(), static_cast<std::size_t>(fingers + 1));
      EXPECT_TRUE(anatomy.side_is_clear);
      EXPECT_EQ(anatomy.side, left ? Side::kLeft : Side::kRight);
      EXPECT_EQ(hand.links[anatomy.fingers[0].links[0].front()].name, "digit_x_0");
      for (int f = 0; f < fingers; ++f) {
        const RobotFinger& finger = anatomy.fingers[f + 1];
        for (int p = 0; p < 3; ++p) {
          ASSERT_EQ(finger.links[p].size(), 1u);
          EXPECT_EQ(hand.links[finger.links[p][0]].name, fmt::format("digit_{}_{}", f, p));
          EXPECT_GT(finger.pads[p].x(), 0.99);
        }
        EXPECT_NEAR(finger.Length(), 0.097, 1e-3);
      }
      EXPECT_GT(anatomy.root_from_axes(2, 0), 0.99);
      EXPECT_GT(anatomy.root_from_axes(0, 2), 0.99);
      EXPECT_GT(anatomy.root_from_axes(1, 1) * (left ? -1.0 : 1.0), 0.99);
      EXPECT_EQ(anatomy.palm_links, std::vector<int>{0});
    }
  }
}

TEST(RobotAnatomy, OfItsOwnTableIsTheSame) {
  const RobotHand hand = Read({.fingers = 3});
  const RobotAnatomy found = FindAnatomy(hand);
  const RobotAnatomy said = AnatomyOf(hand, PartLinksOf(hand, found), "table");
  ASSERT_EQ(said.fingers.size(), found.fingers.size());
  for (std::size_t f = 0; f < found.fingers.size(); ++f) {
    EXPECT_EQ(said.fingers[f].human, found.fingers[f].human);
    EXPECT_EQ(said.fingers[f].links, found.fingers[f].links);
    EXPECT_TRUE(said.fingers[f].nodes[3].isApprox(found.fingers[f].nodes[3]));
  }
  EXPECT_EQ(said.side, found.side);
  EXPECT_TRUE(said.root_from_axes.isApprox(found.root_from_axes));
}

TEST(RobotAnatomy, OfAGripperIsThumbAndIndex) {
  const std::string finger =
      "<link name=\"{0}\"><visual><origin xyz=\"0 0 0.03\"/><geometry><box size=\"0.02 0.02 "
      "0.06\"/>"
      "</geometry></visual></link>\n<joint name=\"slide_{0}\" type=\"prismatic\"><parent "
      "link=\"base\"/><child link=\"{0}\"/><origin xyz=\"0 {1} 0.06\"/><axis xyz=\"0 {2} "
      "0\"/><limit "
      "lower=\"0\" upper=\"0.04\" effort=\"1\" velocity=\"1\"/></joint>\n";
  const TemporaryFolder folder;
  std::ofstream(folder / "gripper.urdf")
      << "<robot name=\"gripper\"><link name=\"base\"><visual><geometry><box size=\"0.06 0.2 "
         "0.1\"/></geometry></visual></link>\n"
      << fmt::format(fmt::runtime(finger), "a", 0.01, 1)
      << fmt::format(fmt::runtime(finger), "b", -0.01, -1) << "</robot>";
  const RobotHand hand = ReadRobotHand(folder / "gripper.urdf");
  const RobotAnatomy anatomy = FindAnatomy(hand, Side::kLeft);
  ASSERT_EQ(anatomy.fingers.size(), 2u);
  EXPECT_FALSE(anatomy.side_is_clear);
  EXPECT_EQ(anatomy.side, Side::kLeft);
  EXPECT_LT(anatomy.fingers[0].pads[2].dot(anatomy.fingers[1].pads[2]), -0.9);
  // Its palm faces along the fingers, which start apart.
  EXPECT_TRUE(anatomy.gripper);
  EXPECT_GT(anatomy.root_from_axes.col(2).z(), 0.9);
  EXPECT_LT((anatomy.root_from_axes.col(0) + anatomy.fingers[1].pads[0]).norm(), 0.1);
  EXPECT_EQ(anatomy.open, Eigen::Vector2d(0.04, 0.04));
  EXPECT_EQ(anatomy.closed, Eigen::Vector2d(0.0, 0.0));
  EXPECT_FALSE(FindAnatomy(Read({})).gripper);
}

TEST(ReadRobotHand, SaysWhatIsWrong) {
  const std::string whole = BoxHand().Urdf();
  EXPECT_THAT(WhatReadingSays(""), HasSubstr("is empty"));
  EXPECT_THAT(WhatReadingSays(whole.substr(0, whole.size() / 2)), HasSubstr("not a valid URDF"));
  EXPECT_THAT(WhatReadingSays("<robot name=\"x\"><link name=\"a\"/></robot>"),
              HasSubstr("no movable joint"));
  EXPECT_THAT(WhatReadingSays(BoxHand{.scale = 1000.0}.Urdf()), HasSubstr("millimeters"));
  std::string nested = "<robot name=\"x\">";
  for (int k = 0; k < 100'000; ++k) nested += "<link>";
  EXPECT_THAT(WhatReadingSays(nested), HasSubstr("nested"));
  EXPECT_THAT(
      WhatReadingSays(BoxHand{.extra = "<link name=\"m\"><visual><geometry><mesh "
                                       "filename=\"package://hand/none.stl\"/></geometry></visual>"
                                       "</link><joint name=\"f\" type=\"fixed\"><parent "
                                       "link=\"palm\"/><child link=\"m\"/></joint>"}
                          .Urdf()),
      HasSubstr("none.stl' is missing"));
  EXPECT_THAT(WhatReadingSays("<mujoco", "hand.xml"), HasSubstr("MuJoCo"));
  EXPECT_THAT(WhatReadingSays(whole, "hand.txt"), HasSubstr("extension"));
  std::string missing = BoxHand{.coupled = true}.Urdf();
  missing.replace(missing.find("mimic joint=\"bend_digit_0_1\""), 28,
                  "mimic joint=\"bend_nobody_xx\"");
  EXPECT_THAT(WhatReadingSays(missing), HasSubstr("follows"));
}

// The box hand with other limits for its first joint.
std::string WithLimits(const std::string& by) {
  constexpr std::string_view kLimits = "lower=\"-0.1\" upper=\"1.6\"";
  std::string text = BoxHand().Urdf();
  return text.replace(text.find(kLimits), kLimits.size(), by);
}

TEST(ReadRobotHand, NamesTheJointWhoseLimitsAreWrong) {
  for (const char* limits : {"lower=\"nan\" upper=\"1.6\"", "lower=\"-0.1\" upper=\"inf\"",
                             "lower=\"-0.1\" upper=\"wide\"", "lower=\"1.6\" upper=\"-0.1\""}) {
    EXPECT_THAT(WhatReadingSays(WithLimits(limits)), HasSubstr("bend_digit_0_0")) << limits;
  }
}

TEST(ReadRobotHand, LimitsThatStandForNoneAreNarrowed) {
  const TemporaryFolder folder;
  std::ofstream(folder / "hand.urdf") << WithLimits("lower=\"-1e30\" upper=\"1e30\"");
  const RobotHand hand = ReadRobotHand(folder / "hand.urdf");
  ASSERT_EQ(hand.notes.size(), 1u);
  EXPECT_THAT(hand.notes[0], HasSubstr("more than once"));
  EXPECT_LT(hand.dofs[0].high, 3.2);
  EXPECT_GT(hand.dofs[0].low, -3.2);
}

TEST(ReadRobotHand, SaysWhatIsLeftOut) {
  constexpr const char* kExtra =
      "<link name=\"m\"><visual><origin xyz=\"nan 0 0\"/><geometry><sphere "
      "radius=\"0.01\"/></geometry></visual></link><joint name=\"f\" type=\"fixed\"><parent "
      "link=\"palm\"/><child link=\"m\"/></joint>";
  const TemporaryFolder folder;
  BoxHand{.extra = kExtra}.Write(folder / "hand.urdf");
  const RobotHand hand = ReadRobotHand(folder / "hand.urdf");
  ASSERT_EQ(hand.notes.size(), 1u);
  EXPECT_THAT(hand.notes[0], HasSubstr("skipped"));
}

TEST(ReadRobotHand, WhatCollidesStandsForMeshesOfOtherFormats) {
  constexpr const char* kExtra =
      "<link name=\"m\"><visual><geometry><mesh filename=\"seen.usd\"/></geometry></visual>{}"
      "</link><joint name=\"f\" type=\"fixed\"><parent link=\"palm\"/><child link=\"m\"/></joint>";
  const TemporaryFolder folder;
  std::ofstream(folder / "seen.usd") << "<COLLADA/>";
  const auto with = [&](const std::string& collision) {
    BoxHand{.extra = fmt::format(kExtra, collision)}.Write(folder / "hand.urdf");
    return ReadRobotHand(folder / "hand.urdf");
  };
  const RobotHand hand =
      with("<collision><geometry><sphere radius=\"0.01\"/></geometry></collision>");
  EXPECT_EQ(hand.links[hand.FindLink("m")].shapes.size(), 1u);
  ASSERT_EQ(hand.notes.size(), 1u);
  EXPECT_THAT(hand.notes[0], HasSubstr("'m'"));
  EXPECT_THROW(with(""), Error);
}

TEST(ReadRobotHand, CapsulesInUrdfHaveTheirEndsBesides) {
  constexpr const char* kExtra =
      "<link name=\"m\"><visual><geometry>{}</geometry></visual></link><joint name=\"f\" "
      "type=\"fixed\"><parent link=\"palm\"/><child link=\"m\"/></joint>";
  const TemporaryFolder folder;
  for (const char* capsule : {"<capsule radius=\"0.01\" length=\"0.03\"/>",
                              "<capsule length='0.03' radius='0.01'></capsule>",
                              "<drake:capsule radius=\"0.01\" length=\"0.03\"/>"}) {
    BoxHand{.extra = fmt::format(kExtra, capsule)}.Write(folder / "hand.urdf");
    const RobotHand hand = ReadRobotHand(folder / "hand.urdf");
    const RobotLink& link = hand.links[hand.FindLink("m")];
    ASSERT_EQ(link.shapes.size(), 1u) << capsule;
    EXPECT_NEAR(Extent(link.shapes[0]).z(), 0.05, 1e-9);
    EXPECT_NEAR(Extent(link.shapes[0]).x(), 0.02, 1e-3);
    EXPECT_TRUE(hand.notes.empty());
  }
  EXPECT_THAT(
      WhatReadingSays(BoxHand{.extra = fmt::format(kExtra, "<capsule radius=\"0.01\"/>")}.Urdf()),
      HasSubstr("capsule"));
}

std::string Mjcf(const std::string& extra, const std::string& size = "0.012") {
  return "<mujoco>" + extra +
         "<worldbody><body name=\"palm\"><geom type=\"box\" size=\"0.04 0.01 0.04\"/><body "
         "name=\"f1\" pos=\"0.03 0 0.08\"><joint name=\"j1\" axis=\"1 0 0\" range=\"0 90\" "
         "limited=\"true\"/><geom type=\"sphere\" size=\"" +
         size + "\"/></body></body></worldbody></mujoco>";
}

// What ends, hangs or swells the libraries is told before they see it, or without them.
TEST(ReadRobotHand, RefusesWhatNoLibraryStands) {
  const auto repeated = [](const std::string& text, int times) {
    std::string all;
    for (int k = 0; k < times; ++k) all += text;
    return all;
  };
  EXPECT_THAT(
      WhatReadingSays("<robot a='" + repeated("/>", 1000) + "'>" + repeated("<link>", 1000)),
      HasSubstr("nested"));
  EXPECT_THAT(
      WhatReadingSays("<robot><!--" + repeated("/>", 1000) + "-->" + repeated("<link>", 1000)),
      HasSubstr("nested"));
  EXPECT_THAT(WhatReadingSays("<robot>" + repeated("<link name='a'/>", 1001)), HasSubstr("links"));
  if (!HasPhysics()) GTEST_SKIP() << "built without MuJoCo";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {Mjcf("", "nan"), "size=\"nan\""},
      {Mjcf("", "&#110;an"), "size=\"nan\""},
      {Mjcf("", "-inf"), "body 'f1'"},
      {Mjcf("", "1e999"), "not finite"},
      {Mjcf("", "1e300"), "size"},
      {Mjcf("<option timestep='nan'/>"), "timestep"},
      {Mjcf("<size nuserdata='300000000'/>"), "gigabytes"},
      {Mjcf("<size nuser_geom='1000000'/>"), "gigabytes"},
      {Mjcf("<asset><hfield name='h' nrow='60000' ncol='60000' size='1 1 1 1'/></asset>"),
       "points"},
      {Mjcf("<asset><texture name='t' type='2d' builtin='flat' width='50000' "
            "height='50000'/></asset>"),
       "points"},
      {Mjcf("<worldbody><body><composite type='grid' count='1000 1000 1' "
            "spacing='1'/></body></worldbody>"),
       "1000000 parts"},
      {Mjcf("<worldbody><replicate count='200'><replicate count='200'/></replicate></worldbody>"),
       "40000 parts"},
      {"<!DOCTYPE a [<!ENTITY b 'c'>]>" + Mjcf(""), "entities"},
      {Mjcf("<include file='/dev/zero'/>"), "a device"},
      {Mjcf("<asset><mesh name='m' file='/'/></asset>"), "a folder"},
      {Mjcf("<asset><mesh name='m' file='none.obj'/></asset>"), "none.obj"}};
  for (const auto& [text, said] : cases) {
    EXPECT_THAT(WhatReadingSays(text, "hand.xml"), HasSubstr(said)) << text.substr(0, 300);
  }
}

// Files that once ended the program (tests/fixtures/cases/attack), and a pipe.
TEST(ReadRobotHand, FaultsOfLibrariesAreErrorsThatNameTheFile) {
  if (!HasPhysics()) GTEST_SKIP() << "built without MuJoCo";
  const TemporaryFolder folder;
  int read = 0;
  const std::filesystem::path cases =
      std::filesystem::path(HOLDFAST_SOURCE_DIR) / "tests/fixtures/cases/attack";
  for (const auto& entry : std::filesystem::directory_iterator(cases)) {
    std::filesystem::copy(entry.path(), folder / entry.path().filename());
  }
  ASSERT_EQ(mkfifo((folder / "fifo.obj").c_str(), 0600), 0);
  for (const auto& entry : std::filesystem::directory_iterator(cases)) {
    if (entry.path().extension() != ".xml") continue;
    ++read;
    const std::string name = entry.path().filename().string();
    EXPECT_THAT(ErrorText([&] { ReadRobotHand(folder / name); }), HasSubstr(name));
  }
  EXPECT_GE(read, 8);
}

TEST(ReaderProcess, AFaultIsAnErrorAndAHandComesBackAsItWas) {
  const auto what = [](const std::function<RobotHand()>& reader) {
    return ErrorText([&] { ReadInProcess("hand.x", "lib", reader); });
  };
  EXPECT_THAT(what([]() -> RobotHand {
                std::raise(SIGSEGV);
                return {};
              }),
              HasSubstr("hand.x: crashes lib (Segmentation fault)"));
  EXPECT_THAT(what([]() -> RobotHand { throw std::runtime_error("odd"); }), HasSubstr("odd"));
  EXPECT_THAT(what([]() -> RobotHand { throw std::bad_alloc(); }), HasSubstr("memory"));
  EXPECT_EQ(what([]() -> RobotHand { throw Error("a", "b", "c"); }), "a: b. c");
  EXPECT_THAT(what([]() -> RobotHand { _exit(0); }), HasSubstr("crashes lib"));
  const RobotHand hand = Read({.coupled = true});
  const RobotHand back = ReadInProcess("hand.x", "lib", [&] { return hand; });
  ASSERT_EQ(back.NumLinks(), hand.NumLinks());
  ASSERT_EQ(back.NumDofs(), hand.NumDofs());
  EXPECT_EQ(back.name, hand.name);
  for (int k = 0; k < hand.NumLinks(); ++k) {
    EXPECT_EQ(back.links[k].name, hand.links[k].name);
    EXPECT_EQ(back.links[k].factor, hand.links[k].factor);
    EXPECT_EQ(back.links[k].parent_from_joint.matrix(), hand.links[k].parent_from_joint.matrix());
    ASSERT_EQ(back.links[k].shapes.size(), hand.links[k].shapes.size());
    EXPECT_EQ(back.links[k].shapes[0].vertices, hand.links[k].shapes[0].vertices);
    EXPECT_EQ(back.links[k].shapes[0].faces, hand.links[k].shapes[0].faces);
  }
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST(ReaderProcess, HasAGigabyte) {
  EXPECT_THROW(ReadInProcess("hand.x", "lib",
                             [] {
                               std::vector<char> much(std::size_t{3} << 30, 'x');
                               RobotHand hand;
                               hand.name.assign(1, much[much.size() / 2]);
                               return hand;
                             }),
               Error);
}
#endif

TEST(ReadRobotHand, JointsWithoutRangeStandStill) {
  const TemporaryFolder folder;
  std::ofstream(folder / "hand.urdf") << WithLimits("lower=\"0.2\" upper=\"0.2\"");
  const RobotHand hand = ReadRobotHand(folder / "hand.urdf");
  EXPECT_EQ(hand.NumDofs(), 14);
  ASSERT_EQ(hand.notes.size(), 1u);
  EXPECT_DOUBLE_EQ(hand.links[hand.FindLink("digit_0_0")].offset, 0.2);
  EXPECT_EQ(FindAnatomy(hand).fingers.size(), 5u);
}

// All terms about a ball that the hand is close around.
class RobotTerms : public ::testing::Test {
 protected:
  RobotTerms()
      : hand_(Read({.coupled = true})),
        anatomy_(FindAnatomy(hand_)),
        solids_(hand_, anatomy_, 1),
        ball_(BallMesh(0.03)),
        distance_(ball_),
        grid_(distance_, {}),
        samples_(InBlocks(ContactSamples(ball_, 0.006, 400))) {
    std::mt19937 random(5);
    pose_.q = RandomNumbers(hand_, random);
    pose_.R = ExpSO3({0.3, -0.2, 0.5});
    pose_.T = pose_.R * Eigen::Vector3d(-0.035, 0.0, -0.09);
    for (const int link : {2, 3, 6, 8, 15}) {
      for (const auto sample : solids_.Of(link).samples.leftCols(4).colwise()) {
        const Eigen::Vector3d out = (sample - solids_.Of(link).center).normalized();
        pairs_.push_back({0, link % 3, true, link, sample, out});
      }
    }
    pads_ = RobotPads(pairs_, solids_);
  }

  // Hand and ball as a transfer has them, without a demonstration.
  RobotTransferSetup Setup() const {
    RobotTransferSetup setup;
    setup.robot = hand_;
    setup.anatomy = anatomy_;
    setup.pads = RobotPads(pairs_, solids_);
    setup.solids = std::make_unique<RobotSolids>(solids_);
    setup.object = ball_;
    setup.object_distance = std::make_unique<SignedDistance>(ball_);
    setup.object_grid =
        std::make_unique<DistanceGrid>(*setup.object_distance, DistanceGridOptions{});
    return setup;
  }

  // The rows that Ceres gets have these normal equations.
  void ExpectRowsOf(const RobotBlock& block, const Eigen::MatrixXd& hessian,
                    const Eigen::VectorXd& gradient) {
    const Eigen::Quaterniond q(pose_.R);
    const double* const parameters[] = {q.coeffs().data(), pose_.T.data(), pose_.q.data()};
    const RotationManifold manifold;
    const auto [r, J] = testing::RowsAt(block, parameters, {&manifold});
    EXPECT_LT((J.transpose() * J - hessian).norm(), 1e-7 * hessian.norm());
    EXPECT_LT((J.transpose() * r - gradient).norm(), 1e-7 * gradient.norm());
  }

  // The gradient against differences of the cost, relative to its largest entry.
  double GradientError(const RobotTerm& term, double length = 1e-7) {
    RobotBlock block(hand_);
    block.SetTerms({&term});
    Eigen::MatrixXd hessian;
    Eigen::VectorXd gradient;
    EXPECT_GT(block.Linearize(pose_, hessian, gradient), 0.0);
    EXPECT_LT((hessian - hessian.transpose()).norm(), 1e-9 * hessian.norm());
    ExpectRowsOf(block, hessian, gradient);
    Eigen::VectorXd numeric(gradient.size());
    for (Eigen::Index k = 0; k < gradient.size(); ++k) {
      double cost[2];
      for (const int s : {0, 1}) {
        const double step = s ? length : -length;
        RobotPose moved = pose_;
        if (k < 3) moved.R = pose_.R * ExpSO3(step * Eigen::Vector3d::Unit(k));
        if (k >= 3 && k < 6) moved.T(k - 3) += step;
        if (k >= 6) moved.q(k - 6) += step;
        PosedRobot posed(hand_);
        posed.Set(moved);
        cost[s] = term.Add(posed, nullptr);
      }
      numeric(k) = (cost[1] - cost[0]) / (2.0 * length);
    }
    return (gradient - numeric).cwiseAbs().maxCoeff() / numeric.cwiseAbs().maxCoeff();
  }

  RobotHand hand_;
  RobotAnatomy anatomy_;
  RobotSolids solids_;
  TriangleMesh ball_;
  SignedDistance distance_;
  DistanceGrid grid_;
  Eigen::Matrix3Xd samples_;
  RobotPose pose_;
  std::vector<SkinPair> pairs_;
  RobotPads pads_;
};

TEST_F(RobotTerms, HaveTheGradientsOfTheirCosts) {
  Eigen::Matrix3Xd human(3, static_cast<Eigen::Index>(pairs_.size()));
  for (Eigen::Index i = 0; i < human.cols(); ++i) human.col(i) = ball_.vertices.col(7 * i);
  // Its sums are of single precision: a longer step.
  EXPECT_LT(GradientError(RobotDistanceTerm(pairs_, human, samples_,
                                            Eigen::VectorXd::Constant(human.cols(), 0.7), 0.01),
                          1e-4),
            1e-3);
  EXPECT_LT(GradientError(RobotContactTerm(pads_,
                                           {{0, {0.03, 0.0, 0.0}, Eigen::Vector3d::UnitX(), 1.0},
                                            {2, {0.0, 0.03, 0.0}, Eigen::Vector3d::UnitY(), 0.5}},
                                           0.001, 0.1)),
            1e-5);
  EXPECT_LT(GradientError(RobotPenetrationTerm(solids_, grid_, samples_, 0.004, 1e-3)), 1e-3);
  EXPECT_LT(GradientError(RobotPostureTerm(hand_.Straight(),
                                           Eigen::VectorXd::Constant(hand_.NumDofs(), 0.3))),
            1e-6);
  EXPECT_LT(
      GradientError(RobotPlaceTerm(Eigen::Isometry3d::Identity(), {0.01, 0.02, 0.09}, 0.2, 0.01)),
      1e-6);
  pose_.q.array() += 2.0;
  EXPECT_LT(GradientError(RobotLimitTerm(1e-3)), 1e-6);
  pose_.q.array() -= 2.0;
  PosedRobot posed(hand_);
  for (double d = 0.0; d < 0.003;) {  // out of the ball
    pose_.T += 0.002 * pose_.T.normalized();
    posed.Set(pose_);
    const auto pad = pads_.Touching(0, posed, grid_);
    d = grid_.Linear(posed.ObjectFromLink(pad->link) * pad->point);
  }
  EXPECT_LT(GradientError(RobotTouchTerm(pads_, grid_, {0, 2}, 0.002, 0.005)), 1e-3);
}

TEST_F(RobotTerms, PadsAreFoundAsByTryingAllTheirPoints) {
  PosedRobot posed(hand_);
  posed.Set(pose_);
  const Eigen::Vector3d point(0.028, 0.004, 0.01),
      normal = Eigen::Vector3d(1.0, 0.2, 0.3).normalized();
  int parts = 0;
  for (int part = 0; part < kNumHandParts; ++part) {
    double cost = 0.0, far = 0.0;
    const auto best = pads_.BestFacing(part, posed, point, normal, 1e6, 100.0, &cost);
    const auto nearest = pads_.Nearest(part, posed, point);
    ASSERT_EQ(best.has_value(), !pads_.Empty(part));
    ASSERT_EQ(nearest.has_value(), !pads_.Empty(part));
    if (!best) continue;
    ++parts;
    const auto place = [&](const PadPoint& pad) {
      return Eigen::Vector3d(posed.ObjectFromLink(pad.link) * pad.point);
    };
    const Eigen::Vector3d m = posed.ObjectFromLink(best->link).linear() * best->normal;
    EXPECT_NEAR(cost,
                1e6 * (place(*best) - point).squaredNorm() + 100.0 * (m + normal).squaredNorm(),
                1e-6 * cost);
    // Places alone: no farther from the nearest of the surface than points are from each other.
    const auto dense = pads_.BestFacing(part, posed, point, normal, 1.0, 0.0, &far);
    EXPECT_LE((place(*nearest) - point).norm(), (place(*dense) - point).norm() + 1e-9);
    EXPECT_LT((place(*dense) - point).norm(), (place(*nearest) - point).norm() + 1e-3);
    EXPECT_GE(cost, 1e6 * (place(*nearest) - point).squaredNorm() - 1e-9);
  }
  EXPECT_EQ(parts, 2);
}

// A pad's nearest point is none that another is nearer than, of what is sampled; the deepest of the
// penetration term is what its samples say, both ways, wherever it was asked before.
TEST_F(RobotTerms, FindWhatTouchesAndWhatIsDeepest) {
  const RobotPenetrationTerm term(solids_, grid_, samples_, 3e-4, 1e-4);
  PosedRobot posed(hand_);
  int inside = 0;
  for (int step = 0; step < 40; ++step) {
    pose_.T = pose_.R * Eigen::Vector3d(-0.035 + 0.001 * step, 0.0, -0.09);
    posed.Set(pose_);
    double deepest = 0.0;
    for (const int link : solids_.Links()) {
      const Eigen::Isometry3d& pose = posed.ObjectFromLink(link);
      for (const auto sample : solids_.Of(link).samples.colwise()) {
        deepest = std::max(deepest, -grid_.Linear(pose * sample));
      }
      const DistanceGrid& solid = *solids_.Of(link).grid;
      for (const auto sample : samples_.colwise()) {
        const Eigen::Vector3d x = pose.inverse() * sample;
        if ((x.array() < solid.Min().array()).any() || (x.array() > solid.Max().array()).any()) {
          continue;
        }
        deepest = std::max(deepest, -solid.Linear(x));
      }
    }
    EXPECT_NEAR(term.Deepest(posed), deepest, 1e-9);
    inside += deepest > 0.0;
    for (const int part : {0, 2}) {
      const auto touching = pads_.Touching(part, posed, grid_);
      ASSERT_TRUE(touching.has_value());
      const auto distance_of = [&](const PadPoint& pad) {
        return grid_.Linear(posed.ObjectFromLink(pad.link) * pad.point);
      };
      for (const auto vertex : ball_.vertices.colwise()) {
        double cost = 0.0;
        const auto other =
            pads_.BestFacing(part, posed, vertex, Eigen::Vector3d::UnitZ(), 1.0, 0.0, &cost);
        EXPECT_LE(distance_of(*touching), distance_of(*other) + 1e-12);
      }
    }
  }
  EXPECT_GT(inside, 5);
  EXPECT_FALSE(pads_.Touching(7, posed, grid_).has_value());
  const auto nearest = pads_.Touching(0, posed, grid_);
  const double away = grid_.Linear(posed.ObjectFromLink(nearest->link) * nearest->point);
  EXPECT_TRUE(pads_.Touching(0, posed, grid_, away + 1e-6).has_value());
  EXPECT_FALSE(pads_.Touching(0, posed, grid_, away - 1e-6).has_value());
}

// Joints and tips of the robot move with their links, and stand for the human's of the same finger.
TEST_F(RobotTerms, KeypointsAreWhereTheLinksAre) {
  const RobotKeypoints keypoints(hand_, anatomy_);
  ASSERT_EQ(keypoints.joints.size(), 3 * anatomy_.fingers.size());
  ASSERT_EQ(keypoints.tips.size(), anatomy_.fingers.size());
  RobotPose straight{Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), hand_.Straight()};
  PosedRobot posed(hand_);
  posed.Set(straight);
  for (std::size_t f = 0; f < anatomy_.fingers.size(); ++f) {
    for (std::size_t p = 0; p < 3; ++p) {
      EXPECT_LT((keypoints.joints[3 * f + p].At(posed) - anatomy_.fingers[f].nodes[p]).norm(),
                1e-9);
    }
    EXPECT_LT((keypoints.tips[f].At(posed) - anatomy_.fingers[f].nodes[3]).norm(), 1e-9);
    EXPECT_EQ(keypoints.human_fingers[f], anatomy_.fingers[f].human);
  }
  // A phalanx keeps its length, whatever the pose.
  posed.Set(pose_);
  for (std::size_t f = 0; f < anatomy_.fingers.size(); ++f) {
    const auto& nodes = anatomy_.fingers[f].nodes;
    EXPECT_NEAR((keypoints.tips[f].At(posed) - keypoints.joints[3 * f + 2].At(posed)).norm(),
                (nodes[3] - nodes[2]).norm(), 1e-9);
  }
}

// The same points, those of a block close together.
TEST(NearSamples, BlocksHoldTheSamePoints) {
  Eigen::Matrix3Xd points(3, 203);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    points.col(i) << static_cast<double>(i * 37 % 203), static_cast<double>(i % 7), 0.0;
  }
  const Eigen::Matrix3Xd blocks = InBlocks(points);
  ASSERT_EQ(blocks.cols(), points.cols());
  for (const auto point : points.colwise()) {
    EXPECT_EQ((blocks.colwise() - point).colwise().norm().minCoeff(), 0.0);
  }
  for (Eigen::Index b = 0; b < blocks.cols(); b += kSampleBlock) {
    const auto block =
        blocks.row(0).segment(b, std::min<Eigen::Index>(kSampleBlock, blocks.cols() - b));
    EXPECT_LT(block.maxCoeff() - block.minCoeff(), 2 * kSampleBlock);
  }
}

// What a term remembers of an earlier pose changes nothing.
TEST_F(RobotTerms, RememberOnlyWhatIsFar) {
  const RobotPenetrationTerm walked(solids_, grid_, samples_, 0.004, 1e-3);
  const RobotSelfTerm walked_self(solids_, 1e-3);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  PosedRobot posed(hand_);
  int touching = 0, meeting = 0;
  for (int step = 0; step < 300; ++step) {
    for (int k = 0; step % 60 == 0 && k < 200; ++k) {  // beyond its limits, where links meet
      pose_.q = 2.0 * RandomNumbers(hand_, random);
      posed.Set(pose_);
      if (RobotSelfTerm(solids_, 1e-3).Add(posed, nullptr) > 0.0) break;
    }
    for (double& number : pose_.q.reshaped()) number += 0.01 * normal(random);
    pose_.T += 1e-3 * Eigen::Vector3d(normal(random), normal(random), normal(random));
    pose_.T *= 0.99;
    posed.Set(pose_);
    const double cost = walked.Add(posed, nullptr), self = walked_self.Add(posed, nullptr);
    ASSERT_EQ(cost,
              RobotPenetrationTerm(solids_, grid_, samples_, 0.004, 1e-3).Add(posed, nullptr));
    ASSERT_EQ(self, RobotSelfTerm(solids_, 1e-3).Add(posed, nullptr));
    touching += cost > 0.0;
    meeting += self > 0.0;
  }
  EXPECT_GT(touching, 50);
  EXPECT_GT(meeting, 5);
}

TEST_F(RobotTerms, LinksThatMeetArePushedApart) {
  // Within its limits this hand cannot do it.
  std::mt19937 random(2);
  for (int trial = 0; trial < 200; ++trial) {
    pose_.q = 2.0 * RandomNumbers(hand_, random);
    PosedRobot posed(hand_);
    posed.Set(pose_);
    const RobotSelfTerm term(solids_, 1e-3);
    if (term.Add(posed, nullptr) == 0.0) continue;
    EXPECT_LT(GradientError(term), 2e-3);
    return;
  }
  FAIL() << "no two links met";
}

// A touch pulls pads that are near, and no others: its cost is flat from 2 cm on.
TEST_F(RobotTerms, OnlyNearPadsAreDrawnToTheObject) {
  const RobotTouchTerm term(pads_, grid_, {0, 2}, 0.002, 0.005);
  const auto cost_at = [&](double away) {
    RobotPose moved = pose_;
    moved.T += away * pose_.T.normalized();
    PosedRobot posed(hand_);
    posed.Set(moved);
    return term.Add(posed, nullptr);
  };
  const double far = cost_at(0.5);
  EXPECT_NEAR(far, 2 * 0.5 * 0.02 * 0.02 / (1.0 + 16.0) / (0.002 * 0.002), 1e-9);
  EXPECT_EQ(cost_at(0.8), far);
  EXPECT_LT(cost_at(0.0), far);
}

// Contacts where a pose has its pads: the starts come back to that pose, at the nearest opening.
TEST_F(RobotTerms, StartsLayPadsOnContacts) {
  RobotTransferSetup setup = Setup();
  setup.pads = RobotPads(pairs_, solids_, true);
  RobotPose truth = pose_;
  truth.q = anatomy_.open + 0.45 * (anatomy_.closed - anatomy_.open);
  PosedRobot posed(hand_);
  posed.Set(truth);
  HumanFrame frame;
  for (const int part : {0, 2}) {
    const auto pad = setup.pads.Middle(part, posed);
    ASSERT_TRUE(pad.has_value());
    const Eigen::Isometry3d& pose = posed.ObjectFromLink(pad->link);
    frame.contacts.push_back({part, pose * pad->point, -(pose.linear() * pad->normal), 1.0});
  }
  const std::vector<RobotPose> starts = ContactStarts(setup, frame);
  ASSERT_EQ(starts.size(), 5u);
  const RobotContactTerm term(setup.pads, frame.contacts, 0.001, 0.1);
  std::vector<double> costs;
  for (const RobotPose& start : starts) {
    posed.Set(start);
    costs.push_back(term.Add(posed, nullptr));
  }
  EXPECT_LT(costs[2], 1.0);
  posed.Set({Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), truth.q});
  EXPECT_GT(term.Add(posed, nullptr), 1000.0);
  frame.contacts.clear();
  EXPECT_TRUE(ContactStarts(setup, frame).empty());
}

// Away from the ball nothing holds it, however little that costs; but not at any price.
TEST_F(RobotTerms, StartsThatHoldAreTaken) {
  const RobotTransferSetup setup = Setup();
  std::mt19937 random(7);
  RobotPose away = pose_;
  away.T += Eigen::Vector3d(0.0, 0.0, 0.5);
  std::vector<RobotPose> poses{away};
  for (int k = 0; k < 200; ++k) {
    pose_.q = RandomNumbers(hand_, random);
    pose_.T = pose_.R * Eigen::Vector3d(-0.03 - 0.0001 * k, 0.0, -0.09);
    poses.push_back(pose_);
  }
  std::vector<double> costs(poses.size(), 1.4);
  costs[0] = 1.0;
  const int chosen = ChooseStart(setup, poses, costs);
  EXPECT_GT(chosen, 0);
  costs[chosen] = 2.9;
  EXPECT_NE(ChooseStart(setup, poses, costs), 0);
  std::fill(costs.begin() + 1, costs.end(), 3.1);
  EXPECT_EQ(ChooseStart(setup, poses, costs), 0);
}

// A thumb on one side of a ball, the index finger beside it, the ring finger opposite: a gripper of
// two takes thumb and ring; if index opposes the thumb as well, the first of both.
TEST(ChooseFingers, TakesThoseThatHold) {
  const TriangleMesh ball = BallMesh(0.03);
  const auto contact = [](int finger, const Eigen::Vector3d& out) {
    return PartContact{3 * finger + 2, 0.03 * out, out, 1.0};
  };
  HumanFrame frame;
  frame.contacts = {contact(kThumb, Eigen::Vector3d::UnitX()),
                    contact(kIndex, Eigen::Vector3d(0.8, 0.6, 0.0)),
                    contact(kRing, -Eigen::Vector3d::UnitX())};
  EXPECT_THAT(ChooseFingers(frame, ball, 2), ElementsAre(kThumb, kRing));
  EXPECT_THAT(ChooseFingers(frame, ball, 3), ElementsAre(kThumb, kIndex, kRing));
  frame.contacts[1] = contact(kIndex, -Eigen::Vector3d::UnitX());
  EXPECT_THAT(ChooseFingers(frame, ball, 2), ElementsAre(kThumb, kIndex));
  EXPECT_THAT(ChooseFingers(frame, ball, 4), ElementsAre(kThumb, kIndex, kMiddle, kRing));
  // Without a thumb in the grasp, a gripper holds with two other fingers.
  frame.contacts.erase(frame.contacts.begin());
  frame.contacts[0] = contact(kIndex, Eigen::Vector3d::UnitX());
  EXPECT_THAT(ChooseFingers(frame, ball, 2), ElementsAre(kIndex, kRing));
  frame.contacts.clear();
  EXPECT_THAT(ChooseFingers(frame, ball, 2), ElementsAre(kThumb, kIndex));
}

TEST(SameGrasp, IsWhatTouchesAndStays) {
  HumanFrame a;
  a.holds = true;
  a.vertices = Eigen::Matrix3Xd::Zero(3, 2);
  a.distance = Eigen::Vector2d(0.001, 0.04);
  a.contacts = {{.part = 2}, {.part = 5}};
  HumanFrame b = a;
  EXPECT_TRUE(SameGrasp(a, b));
  b.vertices.col(0).x() = 2e-4;
  b.vertices.col(1).x() = 0.005;
  EXPECT_TRUE(SameGrasp(a, b)) << "skin away from the object";
  b.vertices.col(0).x() = 3e-4;
  EXPECT_FALSE(SameGrasp(a, b));
  b = a;
  b.contacts[1].part = 6;
  EXPECT_FALSE(SameGrasp(a, b));
  b = a;
  b.holds = false;
  EXPECT_FALSE(SameGrasp(a, b));
}

// A contact 3 mm off a pad, its normal 20 degrees off the pad's; bones as the robot's, the end of
// one 5 mm away and another's turned by 10 degrees; the ball pushed 2 mm into a link.
TEST_F(RobotTerms, MeasuresAreWhatWasPut) {
  RobotTransferSetup setup = Setup();
  PosedRobot posed(hand_);
  posed.Set(pose_);
  const RobotKeypoints keypoints(hand_, anatomy_);
  HumanFrame frame;
  frame.joints.setZero();
  frame.tips.setZero();
  const auto index = std::ranges::find(keypoints.human_fingers, static_cast<int>(kIndex));
  ASSERT_NE(index, keypoints.human_fingers.end());
  const auto f = static_cast<std::size_t>(index - keypoints.human_fingers.begin());
  for (int k = 0; k < 3; ++k) frame.joints.col(k) = keypoints.joints[3 * f + k].At(posed);
  frame.tips.col(kIndex) = keypoints.tips[f].At(posed);
  const Eigen::Vector3d tip_bone = frame.tips.col(kIndex) - frame.joints.col(2);
  frame.tips.col(kIndex) += 0.005 * tip_bone.normalized();
  const std::optional<PadPoint> touch = setup.pads.Touching(2, posed, grid_);
  ASSERT_TRUE(touch);
  const Eigen::Isometry3d& link = posed.ObjectFromLink(touch->link);
  const Eigen::Vector3d pad = link * touch->point, out = link.linear() * touch->normal;
  PartContact contact;
  contact.part = 2;
  contact.point = pad + 0.003 * out;
  contact.normal = ExpSO3(20.0 * kDegree * out.unitOrthogonal()) * -out;
  frame.contacts = {contact};
  setup.demonstration.frames = {frame};
  const RobotMeasures measures = MeasureTransfer(setup, {pose_});
  ASSERT_EQ(measures.contacts, 1);
  EXPECT_NEAR(measures.contact_mm, 3.0, 0.01);
  EXPECT_NEAR(measures.angle_deg, 20.0, 0.1);
  const Eigen::Vector3d there = distance_.Query(pad).gradient;
  EXPECT_NEAR(measures.press_deg, std::acos(there.dot(contact.normal)) / kDegree, 1e-6);
  EXPECT_EQ(measures.bones, 1);
  EXPECT_NEAR(measures.bone_deg, 0.0, 1e-4);
  EXPECT_NEAR(measures.bone_mm, 5.0, 1e-6);

  setup.demonstration.frames[0].tips.col(kIndex) =
      frame.joints.col(2) +
      ExpSO3(10.0 * kDegree * tip_bone.unitOrthogonal()) * Eigen::Vector3d(tip_bone);
  EXPECT_NEAR(MeasureTransfer(setup, {pose_}).bone_deg, 10.0, 1e-4);

  // The same pose again is compared with what the human does then.
  setup.demonstration.frames.push_back(frame);
  setup.demonstration.frames[1].contacts[0].point = pad + 0.005 * out;
  const RobotMeasures two = MeasureTransfer(setup, {pose_, pose_});
  EXPECT_NEAR(two.contact_mm, 4.0, 0.01);
  EXPECT_EQ(two.frames[0].give_mm, two.frames[1].give_mm);
  EXPECT_EQ(two.frames[0].Deepest_mm(), two.frames[1].Deepest_mm());

  // The pad's nearest point put 2 mm under the ball's surface.
  const SignedDistance::Result hit = distance_.Query(pad);
  RobotPose deeper = pose_;
  deeper.T -= (hit.distance + 0.002) * hit.gradient;
  EXPECT_GT(MeasureTransfer(setup, {deeper}).deepest_mm, 1.5);
}

TEST_F(RobotTerms, TouchesMoveAsTheirSlopesSay) {
  const RobotTransferSetup setup = Setup();
  PosedRobot posed(hand_);
  posed.Set(pose_);
  const std::vector<GripContact> touches = TouchesOfRobot(setup, posed, 0.02);
  ASSERT_GT(touches.size(), 1u);
  for (std::size_t a = 0; a < touches.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      if (touches[a].link != touches[b].link) continue;
      EXPECT_GT((touches[a].point - touches[b].point).norm(), 0.01);
    }
  }
  const Eigen::MatrixXd slopes = ContactSlopes(posed.State(), touches);
  ASSERT_EQ(slopes.rows(), 3 * std::ssize(touches));
  for (std::size_t c = 0; c < touches.size(); ++c) {
    const Eigen::Vector3d at = pose_.ObjectFromRoot() * touches[c].point;
    EXPECT_NEAR(distance_.Distance(at), 0.0, 1e-9);                        // on the object
    EXPECT_LT((pose_.R * touches[c].into + at.normalized()).norm(), 0.2);  // into the ball
    const Eigen::Vector3d in_link =
        posed.State().RootFromLink(touches[c].link).inverse() * touches[c].point;
    for (int k = 0; k < hand_.NumDofs(); ++k) {
      RobotState moved(hand_);
      moved.Evaluate(pose_.q + 1e-6 * Eigen::VectorXd::Unit(hand_.NumDofs(), k));
      const Eigen::Vector3d way = moved.RootFromLink(touches[c].link) * in_link - touches[c].point;
      EXPECT_LT((slopes.block<3, 1>(3 * static_cast<Eigen::Index>(c), k) - way / 1e-6).norm(),
                1e-5);
    }
  }
}

}  // namespace
}  // namespace holdfast
