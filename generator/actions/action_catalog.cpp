// SPDX-License-Identifier: MIT
#include "generator/actions/action_catalog.h"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

// Number of letters to change, add or leave out.
std::size_t Difference(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

std::span<const MadeAction> MadeActions() {
  static const std::vector<MadeAction> actions = {
      {"drink", {"mug", "wineglass", "bottle", "bowl"}, 1.3, "rim to the mouth, tilted"},
      {"eat", {"apple", "banana"}, 1.0, "bites"},
      {"pass",
       {"mug", "apple", "bottle", "phone", "banana", "camera", "cube", "sphere", "cylinder",
        "wineglass", "teapot", "flashlight", "lightbulb", "toothbrush", "hammer", "bowl"},
       1.6,
       "held out to a partner"},
      {"inspect",
       {"cube", "sphere", "cylinder", "lightbulb", "apple", "camera", "mug", "phone", "bottle",
        "flashlight", "wineglass"},
       1.4,
       "turned before the eyes"},
      {"lift",
       {"cube", "cylinder", "bottle", "mug", "teapot", "bowl", "hammer", "apple", "wineglass",
        "fryingpan"},
       0.9,
       "straight up and held"},
      {"call", {"phone"}, 1.0, "phone at the ear"},
      {"takepicture", {"camera", "phone"}, 1.0, "lens forward before the eyes"},
      {"brush", {"toothbrush"}, 1.0, "small strokes at the mouth"},
      {"toast", {"wineglass", "mug"}, 1.0, "raised to a partner, then a sip"},
      {"pour", {"teapot", "bottle", "mug"}, 1.1, "spout or rim tilted down"},
      {"offhand",
       {"apple", "cube", "sphere", "cylinder", "banana", "flashlight", "bottle", "phone",
        "lightbulb"},
       1.3,
       "from one hand to the other"},
      {"shake", {"bottle", "cylinder"}, 0.8, "up and down, fast"},
      {"switchON", {"flashlight"}, 0.7, "pointed forward"},
      {"use", {"hammer"}, 0.7, "blows"},
      {"chop", {"knife"}, 0.7, "on the table"},
      {"cook", {"fryingpan"}, 0.7, "swayed"},
  };
  return actions;
}

std::string MadeActionNames() {
  std::vector<std::string_view> names;
  for (const MadeAction& action : MadeActions()) names.push_back(action.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

const MadeAction& FindMadeAction(std::string_view name) {
  const std::span<const MadeAction> all = MadeActions();
  const auto found = std::ranges::find(all, name, &MadeAction::name);
  if (found != all.end()) return *found;
  const auto nearest = std::ranges::min_element(
      all, {}, [&](const MadeAction& action) { return Difference(name, action.name); });
  throw Error(std::string(name), "is no action that can be made",
              fmt::format("Did you mean '{}'? There are {}", nearest->name, MadeActionNames()));
}

std::string_view VocabularyName(std::string_view embedded_object) {
  if (embedded_object == "bottle") return "waterbottle";
  if (embedded_object == "cube") return "cubemedium";
  if (embedded_object == "cylinder") return "cylindermedium";
  if (embedded_object == "sphere") return "spheremedium";
  return embedded_object;
}

}  // namespace holdfast
