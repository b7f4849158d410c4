// SPDX-License-Identifier: MIT
// A cluster of markers on an object that is carried about, and its pose recovered from them.
#include "solver/markers/object_markers.h"

#include <cmath>
#include <fstream>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "tests/support/error_text.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

constexpr int kFrames = 200;

struct ObjectMarkersTest : ::testing::Test {
  ObjectMarkersTest() {
    markers.names = {"cup_a", "cup_b", "cup_c", "cup_d"};
    markers.places.resize(3, 4);
    markers.places << 0.04, -0.04, 0.0, 0.01,  //
        0.0, 0.01, 0.045, -0.03,               //
        0.02, 0.05, 0.09, 0.10;
    recording.names = {"other", "cup_a", "cup_b", "cup_c", "cup_d"};
    recording.rate_hz = 100.0;
    recording.positions.setZero(15, kFrames);
    for (int t = 0; t < kFrames; ++t) {
      for (int k = 0; k < 4; ++k) {
        const Eigen::Vector3d noise(std::sin(7.1 * t + k), std::sin(9.7 * t + 2 * k),
                                    std::sin(5.3 * t + 3 * k));
        recording.positions.block<3, 1>(3 * (k + 1), t) =
            Truth(t) * Eigen::Vector3d(markers.places.col(k)) + 2e-4 * noise;
      }
    }
  }
  static Eigen::Isometry3d Truth(int t) {
    const double s = t / 100.0;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = ExpSO3({0.5 * std::sin(2.0 * s), 0.3 * s, 1.2 * std::sin(s)});
    pose.translation() = Eigen::Vector3d(0.3 * std::sin(1.5 * s), 0.1 * s, 1.0 + 0.2 * s * s);
    return pose;
  }
  void Hide(int marker, int begin, int end) {
    recording.positions.block(3 * marker, begin, 3, end - begin)
        .setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  // The farthest that a point 5 cm from the object's origin is from the truth, mm.
  static double WorstError(const ObjectTrack& track, int begin = 0, int end = kFrames) {
    double worst = 0.0;
    for (int t = begin; t < end; ++t) {
      const Eigen::Isometry3d pose = track.Pose(t);
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d x = 0.05 * Eigen::Vector3d::Unit(axis);
        worst = std::max(worst, 1e3 * (pose * x - Truth(t) * x).norm());
      }
    }
    return worst;
  }
  std::string ErrorOf() const {
    return testing::ErrorText([&] { TrackObject(recording, markers, "trial"); });
  }

  MarkerRecording recording;
  ObjectMarkers markers;
};

TEST_F(ObjectMarkersTest, FollowAnObjectThatIsCarriedAbout) {
  const TrackedObject tracked = TrackObject(recording, markers, "trial");
  EXPECT_LT(WorstError(tracked.track), 1.0);
  EXPECT_LT(tracked.report.rms_mm, 0.4);
  EXPECT_LT(tracked.report.table_rms_mm.value(), 0.3);
  EXPECT_TRUE(tracked.report.gaps.empty());
  EXPECT_TRUE(tracked.report.faults.outliers.empty());
  EXPECT_TRUE(tracked.report.faults.swaps.empty());
}

TEST_F(ObjectMarkersTest, WithoutPlacesHaveAFrameInTheirMiddle) {
  const Eigen::Vector3d middle = markers.places.rowwise().mean();
  markers.places.resize(3, 0);
  const ObjectTrack track = TrackObject(recording, markers, "trial").track;
  for (const int t : {0, 70, kFrames - 1}) {
    EXPECT_LT((Eigen::Vector3d(track.trans.col(t)) - Truth(t) * middle).norm(), 5e-4);
    EXPECT_LT(AngleBetween(track.Pose(t).linear() * track.Pose(0).linear().transpose(),
                           Truth(t).linear() * Truth(0).linear().transpose()),
              0.01);
  }
  EXPECT_LT(track.orient.col(0).norm(), 0.01);
}

// What fills a gap does not depend on where the laboratory has its origin, nor on rounding.
TEST_F(ObjectMarkersTest, PassGapsAlikeWhereverTheOriginIs) {
  for (const int marker : {1, 2, 3, 4}) Hide(marker, 60, 85);
  const ObjectTrack near = TrackObject(recording, markers, "trial").track;
  const Eigen::Vector3d away(5.0, -3.0, 2.0);
  for (int m = 0; m < recording.NumMarkers(); ++m) {
    recording.positions.middleRows<3>(3 * m).colwise() += away;
  }
  const ObjectTrack far = TrackObject(recording, markers, "trial").track;
  EXPECT_LT(((far.trans.colwise() - away) - near.trans).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LT((far.orient - near.orient).cwiseAbs().maxCoeff(), 1e-8);
}

TEST_F(ObjectMarkersTest, PassGapsAsTheObjectMoved) {
  for (const int marker : {1, 2, 3, 4}) Hide(marker, 60, 85);
  for (const int marker : {1, 4}) Hide(marker, 120, 150);  // two of four tell most
  for (const int marker : {1, 2, 3, 4}) Hide(marker, 195, 200);
  const TrackedObject tracked = TrackObject(recording, markers, "trial");
  EXPECT_THAT(tracked.report.gaps, ElementsAre(Pair(60, 85), Pair(120, 150), Pair(195, 200)));
  EXPECT_LT(WorstError(tracked.track, 0, 60), 1.0);
  EXPECT_LT(WorstError(tracked.track, 60, 85), 5.0);
  EXPECT_LT(WorstError(tracked.track, 120, 150), 5.0);
  EXPECT_LT(WorstError(tracked.track, 195, 200), 60.0);  // stays where it was seen last
  EXPECT_EQ(tracked.report.markers[0].longest_gap, 30);
}

TEST_F(ObjectMarkersTest, LeaveOutliersOutAndPutSwappedLabelsRight) {
  for (int t = 5; t < kFrames; t += 20) recording.positions(3 * 2, t) += 0.08;
  recording.positions.block(3, 100, 3, 30).swap(recording.positions.block(9, 100, 3, 30));
  const TrackedObject tracked = TrackObject(recording, markers, "trial");
  EXPECT_LT(WorstError(tracked.track), 1.5);
  EXPECT_EQ(tracked.report.faults.swaps.size(), 30u);
  EXPECT_EQ(tracked.report.markers[0].swapped, 30);
  EXPECT_EQ(tracked.report.markers[2].swapped, 30);
  EXPECT_EQ(tracked.report.faults.outliers.size(), 10u);
  EXPECT_EQ(tracked.report.markers[1].outliers, 10);
  EXPECT_NEAR(tracked.report.faults.outliers[0].off_m, 0.08, 0.002);
}

// Three markers, two sides alike: lengths say nothing of a swap, the leap of the object does.
TEST_F(ObjectMarkersTest, OfAnIsoscelesTriangleDoNotTurnTheObjectAround) {
  markers.names.pop_back();
  markers.places =
      (Eigen::Matrix3d() << 0.04, -0.04, 0.0, 0.0, 0.0, 0.07, 0.0, 0.0, 0.0).finished();
  for (int t = 0; t < kFrames; ++t) {
    for (int k = 0; k < 3; ++k) {
      recording.positions.block<3, 1>(3 * (k + 1), t) =
          Truth(t) * Eigen::Vector3d(markers.places.col(k));
    }
  }
  recording.positions.block(3, 40, 3, 15).swap(recording.positions.block(6, 40, 3, 15));
  const TrackedObject tracked = TrackObject(recording, markers, "trial");
  EXPECT_LT(WorstError(tracked.track), 0.5);
  EXPECT_EQ(tracked.report.faults.swaps.size(), 15u);
}

TEST_F(ObjectMarkersTest, SayWhatIsWrong) {
  const ObjectMarkers good = markers;
  markers.names[2] = "cup_cc";
  EXPECT_THAT(ErrorOf(), HasSubstr("has no marker 'cup_cc' of the object. Did you mean 'cup_c'"));
  markers.names[2] = "CUP_A";
  EXPECT_THAT(ErrorOf(), HasSubstr("listed twice"));
  markers = good;
  markers.places.col(1).x() += 0.3;
  EXPECT_THAT(ErrorOf(), HasSubstr("from their given positions"));
  markers = {{"cup_a"}, {}};
  EXPECT_THAT(ErrorOf(), HasSubstr("fewer than three of the object's markers are seen at a time"));
  markers = good;
  Hide(1, 0, kFrames);
  EXPECT_EQ(ErrorOf(), "no error") << "three are enough";
  Hide(2, 0, kFrames);
  EXPECT_THAT(ErrorOf(), HasSubstr("fewer than three"));
  const ObjectMarkers line{{"cup_a", "cup_b", "cup_c"}, {}};
  markers = line;
  for (int t = 0; t < kFrames; ++t) {
    for (int k = 1; k < 4; ++k) {
      recording.positions.block<3, 1>(3 * k, t) = Truth(t) * Eigen::Vector3d(0.1 * k, 0.0, 0.0);
    }
  }
  EXPECT_THAT(ErrorOf(), HasSubstr("on a line"));
}

TEST_F(ObjectMarkersTest, AreNamedOrReadFromATable) {
  EXPECT_THAT(ObjectMarkersOf("cup_a, CUP_C", recording, "trial").names,
              ElementsAre("cup_a", "CUP_C"));
  EXPECT_EQ(ObjectMarkersOf("cup_*", recording, "trial").names, markers.names);
  const testing::TemporaryFolder folder;
  const auto error = [&](const std::string& text) -> std::string {
    const std::filesystem::path path = folder / "cup.csv";
    std::ofstream(path) << text;
    try {
      const ObjectMarkers read = ObjectMarkersOf(path.string(), recording, "trial");
      EXPECT_EQ(read.names.size(), static_cast<std::size_t>(read.places.cols()));
      return std::string("read ") + std::to_string(read.places.cols());
    } catch (const Error& fault) {
      return fault.what();
    }
  };
  EXPECT_EQ(error("Name, X,y,z\r\ncup_a,0.04,0,0.02\r\n\ncup_b,-0.04,1e-2,0.05\n"), "read 2");
  EXPECT_THAT(error("name,x,y\n"), HasSubstr("cup.csv:1: its first line does not name"));
  EXPECT_THAT(error("name,x,y,z\ncup_a,1,2\n"), HasSubstr("cup.csv:2: 3 fields"));
  EXPECT_THAT(error("name,x,y,z\ncup_a,1,2,mm\n"), HasSubstr("'mm' is not a coordinate in meters"));
  EXPECT_THAT(error("name,x,y,z\ncup_a,40,2,1\n"), HasSubstr("'40' is not a coordinate in meters"));
  EXPECT_THAT(error("name,x,y,z\n"), HasSubstr("lists no markers"));
  EXPECT_THAT(error("name,x,y,z\ncap_a,0,0,0\n"), HasSubstr("Did you mean 'cup_a'"));
  EXPECT_THROW(ObjectMarkersOf("mug_*", recording, "trial"), Error);
  EXPECT_THROW(ObjectMarkersOf("nowhere.csv", recording, "trial"), Error);
}

}  // namespace
}  // namespace holdfast
