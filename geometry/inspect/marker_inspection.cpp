// SPDX-License-Identifier: MIT
#include "geometry/inspect/marker_inspection.h"

#include <algorithm>
#include <set>

#include <Eigen/Geometry>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/io/markers/marker_recording.h"

namespace holdfast {
namespace {

constexpr double kJump_m_s2 = 200.0;  // people stay below; labels swapped and ghosts do not
constexpr double kSmallest_m = 0.05;  // what is captured of people lies between these
constexpr double kLargest_m = 30.0;

struct Gaps {
  int missing = 0, longest = 0;
};

Gaps GapsOf(const MarkerRecording& recording, int marker) {
  Gaps gaps;
  int run = 0;
  for (int t = 0; t < recording.NumFrames(); ++t) {
    run = recording.Seen(marker, t) ? 0 : run + 1;
    gaps.missing += run > 0 ? 1 : 0;
    gaps.longest = std::max(gaps.longest, run);
  }
  return gaps;
}

// Frames in which the marker's acceleration is more than a body's.
int Jumps(const MarkerRecording& recording, int marker) {
  const double most = kJump_m_s2 / (recording.rate_hz * recording.rate_hz);
  int jumps = 0;
  for (int t = 1; t + 1 < recording.NumFrames(); ++t) {
    const Eigen::Vector3d change =
        recording.At(marker, t + 1) - 2.0 * recording.At(marker, t) + recording.At(marker, t - 1);
    jumps += change.norm() > most ? 1 : 0;  // never with NaN
  }
  return jumps;
}

void DescribeMarkers(const MarkerRecording& recording, Inspection& inspection) {
  const int frames = recording.NumFrames();
  const std::set<std::string> subjects(recording.subjects.begin(), recording.subjects.end());
  inspection.AddFact(
      "markers", recording.NumMarkers(),
      fmt::format("{} markers: {}", recording.NumMarkers(), fmt::join(recording.names, " ")));
  inspection.AddFact(
      "frames", frames,
      fmt::format("{} frames at {:g} Hz ({:.1f} s), from frame {}", frames, recording.rate_hz,
                  frames / recording.rate_hz, recording.first_frame));
  inspection.AddFact("frame_rate_hz", recording.rate_hz, "");
  if (*subjects.rbegin() != "") {
    inspection.AddFact("subjects", fmt::format("{}", fmt::join(subjects, " ")),
                       fmt::format("subject: {}", fmt::join(subjects, ", ")));
  }
  inspection.AddFact("unit", recording.unit, fmt::format("unit: {}", recording.unit));
  if (subjects.size() > 1) {
    inspection.Warn(fmt::format("markers of {} subjects", subjects.size()),
                    "each is a person or an object of its own");
  }
}

void JudgeExtent(const MarkerRecording& recording, Inspection& inspection) {
  Eigen::AlignedBox3d box;
  for (int m = 0; m < recording.NumMarkers(); ++m) {
    for (int t = 0; t < recording.NumFrames(); ++t) {
      if (recording.Seen(m, t)) box.extend(recording.At(m, t));
    }
  }
  if (box.isEmpty()) {
    inspection.Fault("no marker is seen in any frame", "export it again with its trajectories");
    return;
  }
  const Eigen::Vector3d size = box.sizes();
  inspection.AddFact("extent_m", std::vector<double>(size.begin(), size.end()),
                     fmt::format("extent: {:.2f} x {:.2f} x {:.2f} m, z from {:.2f} to {:.2f}; the "
                                 "file does not say which axis is up",
                                 size.x(), size.y(), size.z(), box.min().z(), box.max().z()));
  if (size.maxCoeff() < kSmallest_m || size.maxCoeff() > kLargest_m) {
    inspection.Fault(
        fmt::format("the markers span {:.3g} m: not in {}", size.maxCoeff(), recording.unit),
        "check the unit in the file");
  }
}

void JudgeGaps(const MarkerRecording& recording, Inspection& inspection) {
  std::vector<std::string> never, partly, jumping;
  int complete = 0;
  for (int m = 0; m < recording.NumMarkers(); ++m) {
    const Gaps gaps = GapsOf(recording, m);
    if (gaps.missing == recording.NumFrames()) {
      never.push_back(recording.names[m]);
      continue;
    }
    complete += gaps.missing == 0 ? 1 : 0;
    if (gaps.missing > 0) {
      partly.push_back(fmt::format("{} {} frames (longest gap {})", recording.names[m],
                                   gaps.missing, gaps.longest));
    }
    if (const int jumps = Jumps(recording, m); jumps > 0) {
      jumping.push_back(fmt::format("{} {}", recording.names[m], jumps));
    }
  }
  inspection.AddFact("markers_complete", complete, "");
  if (!never.empty()) {
    inspection.Warn(fmt::format("never seen: {}", fmt::join(never, " ")),
                    "they may be in the static trial alone");
  }
  if (!partly.empty()) {
    inspection.Warn(fmt::format("gaps: {}", fmt::join(partly, ", ")),
                    "fill them in the capture software, or leave them");
  }
  if (!jumping.empty()) {
    inspection.Warn(fmt::format("accelerations over {:g} m/s2, in frames: {}", kJump_m_s2,
                                fmt::join(jumping, ", ")),
                    "look for swapped labels and ghosts there");
  }
  if (never.empty() && partly.empty()) inspection.Ok("every marker is seen in every frame");
}

}  // namespace

void InspectMarkers(Inspection& inspection) {
  const MarkerRecording recording = ReadMarkers(inspection.path);
  inspection.title = fmt::format("marker recording: {}", MarkerFormatName(recording.format));
  if (inspection.identity.gzipped) inspection.title += ", gzipped";
  DescribeMarkers(recording, inspection);
  for (const std::string& note : recording.notes) {
    inspection.Warn(note, "it is read all the same; export it again to be sure");
  }
  JudgeExtent(recording, inspection);
  JudgeGaps(recording, inspection);
}

}  // namespace holdfast
