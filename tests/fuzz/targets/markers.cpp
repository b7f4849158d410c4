// SPDX-License-Identifier: MIT
#include <cmath>

#include "geometry/io/markers/c3d.h"
#include "geometry/io/markers/marker_tables.h"
#include "tests/fuzz/fuzz_target.h"

HOLDFAST_FUZZ_TARGET(markers) {
  using holdfast::fuzz::Require;
  const holdfast::MarkerRecording recording = holdfast::ParseMarkers(trial.Text(), "markers");
  trial.Accept();
  Require(recording.NumMarkers() > 0 && recording.NumFrames() > 0, "markers and frames");
  Require(recording.positions.rows() == 3 * recording.NumMarkers(), "three rows a marker");
  Require(recording.subjects.size() == recording.names.size(), "a subject a marker");
  Require(recording.rate_hz > 0.0 && std::isfinite(recording.rate_hz), "a positive rate");
  for (int m = 0; m < recording.NumMarkers(); ++m) {
    for (int t = 0; t < recording.NumFrames(); ++t) {
      const bool seen = recording.Seen(m, t);
      Require(seen ? recording.At(m, t).allFinite() : recording.At(m, t).array().isNaN().all(),
              "seen in all three coordinates or in none");
    }
  }
}
