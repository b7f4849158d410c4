// SPDX-License-Identifier: MIT
#include "geometry/io/container/json_file.h"

#include <algorithm>
#include <array>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"

namespace holdfast {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxDepth = 100;
// Memory cost of a value: its slot (lists double as they grow) and its content.
constexpr std::size_t kSlotBytes = 3 * sizeof(json);
constexpr std::size_t kListBytes = 64, kObjectBytes = 80, kKeyBytes = 112, kTextBytes = 48;

// Adds up the memory that a document would take, and stops if that is too much.
class Meter : public nlohmann::json_sax<json> {
 public:
  explicit Meter(std::size_t budget) : left_(budget) {}

  bool null() override { return Take(kSlotBytes); }
  bool boolean(bool) override { return Take(kSlotBytes); }
  bool number_integer(number_integer_t) override { return Take(kSlotBytes); }
  bool number_unsigned(number_unsigned_t) override { return Take(kSlotBytes); }
  bool number_float(number_float_t, const string_t&) override { return Take(kSlotBytes); }
  bool string(string_t& text) override { return Take(kSlotBytes + kTextBytes + text.size()); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return Open(kObjectBytes); }
  bool key(string_t& text) override { return Take(kKeyBytes + text.size()); }
  bool end_object() override { return Close(); }
  bool start_array(std::size_t) override { return Open(kListBytes); }
  bool end_array() override { return Close(); }
  bool parse_error(std::size_t position, const std::string&, const json::exception&) override {
    problem = fmt::format("is not valid JSON (byte {})", position);
    return false;
  }

  std::string problem;

 private:
  bool Take(std::size_t bytes) {
    if (bytes <= left_) {
      left_ -= bytes;
      return true;
    }
    problem = "holds far more JSON than a file of its size should hold";
    return false;
  }
  bool Open(std::size_t bytes) {
    if (++depth_ <= kMaxDepth) return Take(kSlotBytes + bytes);
    problem = fmt::format("nests its JSON more than {} levels deep", kMaxDepth);
    return false;
  }
  bool Close() {
    --depth_;
    return true;
  }

  std::size_t left_;
  std::size_t depth_ = 0;
};

}  // namespace

nlohmann::json ParseJsonWithin(std::string_view text, const std::string& where,
                               std::size_t file_bytes) {
  Meter meter(8 * file_bytes + (std::size_t{32} << 20));
  if (!json::sax_parse(text, &meter)) {
    throw Error(where, meter.problem.empty() ? "is not valid JSON" : meter.problem,
                "Fetch the file again");
  }
  return json::parse(text, nullptr, /*allow_exceptions=*/false);
}

namespace {

constexpr std::array<std::string_view, 18> kWallTimeKeys = {"closing_ms",
                                                            "core_s",
                                                            "finishing_seconds_median",
                                                            "frames_per_s",
                                                            "made_ms",
                                                            "ms_per_frame",
                                                            "ms_slowest_frame",
                                                            "processor_seconds",
                                                            "refinement_ms",
                                                            "search_ms",
                                                            "seconds",
                                                            "seconds_at",
                                                            "seconds_mean",
                                                            "seconds_median",
                                                            "solve_ms",
                                                            "solve_ms_median",
                                                            "start_ms",
                                                            "success_by_seconds"};

}  // namespace

nlohmann::json TakeWallTimes(nlohmann::json& result) {
  nlohmann::json times;
  if (result.is_object()) {
    for (auto item = result.begin(); item != result.end();) {
      if (std::ranges::find(kWallTimeKeys, item.key()) != kWallTimeKeys.end()) {
        times[item.key()] = std::move(item.value());
        item = result.erase(item);
        continue;
      }
      if (nlohmann::json inner = TakeWallTimes(item.value()); !inner.is_null()) {
        times[item.key()] = std::move(inner);
      }
      ++item;
    }
  } else if (result.is_array() && !result.empty() && result.front().is_structured()) {
    bool any = false;
    nlohmann::json list = nlohmann::json::array();
    for (nlohmann::json& element : result) {
      list.push_back(TakeWallTimes(element));
      any |= !list.back().is_null();
    }
    if (any) times = std::move(list);
  }
  return times;
}

nlohmann::json WriteWithoutWallTimes(nlohmann::json result, const std::filesystem::path& file,
                                     const std::filesystem::path& times_file) {
  const nlohmann::json times = TakeWallTimes(result);
  WriteAtomically(file, JsonText(result, 1) + "\n");
  if (!times.is_null()) WriteAtomically(times_file, JsonText(times, 1) + "\n");
  return result;
}

}  // namespace holdfast
