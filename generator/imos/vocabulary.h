// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace holdfast::imos {

inline constexpr int kNumActions = 29;
inline constexpr int kNumObjects = 54;

/// An action of the GRAB recordings as IMoS (Ghosh et al. 2023) numbers them.
struct Action {
  std::string_view label;  ///< "takepicture"
  std::string_view verb;   ///< of the sentence: "takes picture with"
};

/// All actions and objects; a name's place is its id in one-hot vectors and tables.
std::span<const Action, kNumActions> Actions();
std::span<const std::string_view, kNumObjects> Objects();

/// Ids by name. Upper case, spaces, '-' and '_' do not matter ("Switch on", "wine glass"); nor does
/// which of the names below is given for an object; everyday names of actions are known too
/// ("phone": call, "brush teeth": brush, "photograph": takepicture, "hand over": pass).
std::optional<int> FindAction(std::string_view name);
std::optional<int> FindObject(std::string_view name);
/// The same. Throws Error (`where` names the option or field) with the nearest name by edit
/// distance and the whole list; of actions, those `offered` where that is not empty.
int ActionId(std::string_view name, std::string_view where = "action",
             std::span<const std::string_view> offered = {});
int ObjectId(std::string_view name, std::string_view where = "object");

/// The name of the object's mesh among the embedded ones, and back: bottle is waterbottle in the
/// vocabulary, cube, cylinder and sphere are the medium ones; all others are called the same.
/// Whether there is an embedded mesh of that name is for its library to say.
std::string_view EmbeddedMeshName(std::string_view vocabulary_name);
std::string_view VocabularyName(std::string_view embedded_mesh_name);

struct Intent {
  int action = 0;
  int object = 0;
};

/// "The person drinks from the mug."
std::string SentenceOf(const Intent& intent);

/// Finds the action and the object that a sentence speaks of: "The person drinks from the mug", "he
/// is pouring out of a small sphere", "drink mug". Verbs may end in -s or -ing; of several
/// fitting words the longest counts, then the first for the action and the last for the object.
/// Throws Error when either is missing, with the nearest known name to any of the words; it lists
/// the actions and objects `offered`, all where those are empty.
Intent ParseSentence(std::string_view sentence,
                     std::span<const std::string_view> offered_actions = {},
                     std::span<const std::string_view> offered_objects = {});

}  // namespace holdfast::imos
