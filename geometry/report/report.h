// SPDX-License-Identifier: MIT
#pragma once

/// A clip for a player in a page: the clip with its scene and metrics comes in; JSON and packed
/// arrays come out.
///
/// From the inside out:
///   report_payload.h  typed arrays, deflated, as base64
///   report_facts.h    curves, facts and notes of a clip
///   report_data.h     MakeReportClip: all of it
#include "geometry/report/report_data.h"
#include "geometry/report/report_facts.h"
