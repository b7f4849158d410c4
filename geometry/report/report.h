// SPDX-License-Identifier: MIT
#pragma once

/// A clip for a player in a page: the clip with its scene and metrics comes in; a page comes out,
/// or the JSON and packed arrays in it. player/ has the page's script, style and markup, bundled
/// when the library is built.
///
/// From the inside out:
///   report_payload.h  typed arrays, deflated, as base64
///   report_facts.h    curves, facts and notes of a clip
///   report_data.h     MakeReportClip: all of it
///   report_page.h     MakeReportPage: the page
#include "geometry/report/report_data.h"
#include "geometry/report/report_facts.h"
#include "geometry/report/report_page.h"
