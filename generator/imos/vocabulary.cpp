// SPDX-License-Identifier: MIT
#include "generator/imos/vocabulary.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/suggestion.h"

namespace holdfast::imos {
namespace {

constexpr std::array<Action, kNumActions> kActions{{
    {"offhand", "offhands"},     {"pass", "passes"},
    {"lift", "lifts"},           {"drink", "drinks from"},
    {"brush", "brushes with"},   {"eat", "eats"},
    {"peel", "peels"},           {"takepicture", "takes picture with"},
    {"see", "sees in"},          {"wear", "wears"},
    {"play", "plays"},           {"clean", "cleans"},
    {"browse", "browses on"},    {"inspect", "inspects"},
    {"pour", "pours from"},      {"use", "uses"},
    {"switchON", "switches on"}, {"cook", "cooks on"},
    {"toast", "toasts with"},    {"staple", "staples with"},
    {"squeeze", "squeezes"},     {"set", "sets"},
    {"open", "opens"},           {"chop", "chops with"},
    {"screw", "screws"},         {"call", "calls on"},
    {"shake", "shakes"},         {"fly", "flies"},
    {"stamp", "stamps with"},
}};

constexpr std::array<std::string_view, kNumObjects> kObjects{
    "cylinderlarge", "mug",           "elephant",     "hand",           "cubelarge",
    "stanfordbunny", "airplane",      "alarmclock",   "banana",         "body",
    "bowl",          "cubesmall",     "cup",          "doorknob",       "cubemedium",
    "eyeglasses",    "flashlight",    "flute",        "gamecontroller", "hammer",
    "headphones",    "knife",         "lightbulb",    "mouse",          "phone",
    "piggybank",     "pyramidlarge",  "pyramidsmall", "pyramidmedium",  "duck",
    "scissors",      "spherelarge",   "spheresmall",  "stamp",          "stapler",
    "table",         "teapot",        "toruslarge",   "torussmall",     "train",
    "watch",         "cylindersmall", "waterbottle",  "torusmedium",    "cylindermedium",
    "spheremedium",  "wristwatch",    "wineglass",    "camera",         "binoculars",
    "fryingpan",     "toothpaste",    "apple",        "toothbrush"};

struct Alias {
  std::string_view name, known;
};
// Everyday names, in the form returned by Plain().
constexpr std::array kActionAliases{
    Alias{"phone", "call"},
    Alias{"telephone", "call"},
    Alias{"brushteeth", "brush"},
    Alias{"photograph", "takepicture"},
    Alias{"photographs", "takepicture"},
    Alias{"photographing", "takepicture"},
    Alias{"takesapicturewith", "takepicture"},
    Alias{"takeapicture", "takepicture"},
    Alias{"takesapicture", "takepicture"},
    Alias{"takepictures", "takepicture"},
    Alias{"takingapicture", "takepicture"},
    Alias{"takingpictures", "takepicture"},
    Alias{"handover", "pass"},
    Alias{"handsover", "pass"},
    Alias{"handingover", "pass"},
    Alias{"turnon", "switchON"},
    Alias{"turnson", "switchON"},
    Alias{"changehands", "offhand"},
    Alias{"changeshands", "offhand"},
};
// A word or two that say an action without its name; the first may be inflected. Those of weight 1
// are a part of many actions.
struct ActionWord {
  std::string_view words, label;
  int weight = 2;
};
constexpr std::array kActionWords{ActionWord{"sip", "drink"},
                                  ActionWord{"gulp", "drink"},
                                  ActionWord{"swallow", "drink"},
                                  ActionWord{"thirsty", "drink"},
                                  ActionWord{"bite", "eat"},
                                  ActionWord{"chew", "eat"},
                                  ActionWord{"taste", "eat"},
                                  ActionWord{"nibble", "eat"},
                                  ActionWord{"hungry", "eat"},
                                  ActionWord{"tooth", "brush"},
                                  ActionWord{"teeth", "brush"},
                                  ActionWord{"fill", "pour"},
                                  ActionWord{"empty", "pour"},
                                  ActionWord{"spill", "pour"},
                                  ActionWord{"ring", "call"},
                                  ActionWord{"dial", "call"},
                                  ActionWord{"talk", "call"},
                                  ActionWord{"answer", "call"},
                                  ActionWord{"photo", "takepicture"},
                                  ActionWord{"picture", "takepicture"},
                                  ActionWord{"snapshot", "takepicture"},
                                  ActionWord{"film", "takepicture"},
                                  ActionWord{"look through", "see"},
                                  ActionWord{"watch", "see"},
                                  ActionWord{"peer", "see"},
                                  ActionWord{"put on", "wear"},
                                  ActionWord{"dress", "wear"},
                                  ActionWord{"music", "play"},
                                  ActionWord{"game", "play"},
                                  ActionWord{"wipe", "clean"},
                                  ActionWord{"wash", "clean"},
                                  ActionWord{"dust", "clean"},
                                  ActionWord{"polish", "clean"},
                                  ActionWord{"scroll", "browse"},
                                  ActionWord{"swipe", "browse"},
                                  ActionWord{"surf", "browse"},
                                  ActionWord{"examine", "inspect"},
                                  ActionWord{"study", "inspect"},
                                  ActionWord{"check", "inspect"},
                                  ActionWord{"look at", "inspect"},
                                  ActionWord{"hit", "use"},
                                  ActionWord{"pound", "use"},
                                  ActionWord{"nail", "use"},
                                  ActionWord{"light", "switchON"},
                                  ActionWord{"activate", "switchON"},
                                  ActionWord{"fry", "cook"},
                                  ActionWord{"boil", "cook"},
                                  ActionWord{"stir", "cook"},
                                  ActionWord{"cheers", "toast"},
                                  ActionWord{"clink", "toast"},
                                  ActionWord{"celebrate", "toast"},
                                  ActionWord{"squash", "squeeze"},
                                  ActionWord{"press", "squeeze"},
                                  ActionWord{"wind", "set"},
                                  ActionWord{"uncap", "open"},
                                  ActionWord{"unscrew", "open"},
                                  ActionWord{"unlock", "open"},
                                  ActionWord{"cut", "chop"},
                                  ActionWord{"slice", "chop"},
                                  ActionWord{"dice", "chop"},
                                  ActionWord{"twist", "screw"},
                                  ActionWord{"rattle", "shake"},
                                  ActionWord{"swing", "shake"},
                                  ActionWord{"soar", "fly"},
                                  ActionWord{"seal", "stamp"},
                                  ActionWord{"give", "pass"},
                                  ActionWord{"offer", "pass"},
                                  ActionWord{"deliver", "pass"},
                                  ActionWord{"other hand", "offhand"},
                                  ActionWord{"switch hands", "offhand"},
                                  ActionWord{"raise", "lift", 1},
                                  ActionWord{"pick up", "lift", 1},
                                  ActionWord{"hold up", "lift", 1},
                                  ActionWord{"take", "lift", 1},
                                  ActionWord{"grab", "lift", 1},
                                  ActionWord{"look", "inspect", 1}};

// Named in sentences about other actions: "inspect the cup and take a sip".
constexpr std::array<std::string_view, 4> kPartsOfOthers{"lift", "use", "inspect", "pass"};

// Actions whose motion is most alike, best first.
struct Similar {
  std::string_view label, first, second;
};
constexpr std::array kSimilar{
    Similar{"peel", "eat", "inspect"},     Similar{"see", "takepicture", "drink"},
    Similar{"wear", "call", "drink"},      Similar{"play", "call", "inspect"},
    Similar{"clean", "inspect", "brush"},  Similar{"browse", "inspect", "call"},
    Similar{"staple", "use", "chop"},      Similar{"squeeze", "pour", "inspect"},
    Similar{"set", "switchON", "inspect"}, Similar{"open", "inspect", "pour"},
    Similar{"screw", "switchON", "use"},   Similar{"fly", "shake", "lift"},
    Similar{"stamp", "use", "chop"},       Similar{"toast", "drink", "lift"},
    Similar{"lift", "inspect", "pass"},    Similar{"offhand", "pass", "inspect"}};

constexpr std::array kObjectAliases{
    Alias{"bottle", "waterbottle"},       Alias{"cube", "cubemedium"},
    Alias{"cylinder", "cylindermedium"},  Alias{"sphere", "spheremedium"},
    Alias{"pyramid", "pyramidmedium"},    Alias{"torus", "torusmedium"},
    Alias{"glass", "wineglass"},          Alias{"pan", "fryingpan"},
    Alias{"bunny", "stanfordbunny"},      Alias{"glasses", "eyeglasses"},
    Alias{"controller", "gamecontroller"}};
constexpr std::span kMeshes = std::span(kObjectAliases).first<4>();  // with embedded meshes

// Lower case, letters and digits only.
std::string Plain(std::string_view text) {
  std::string plain;
  for (const char c : text) {
    const auto letter = static_cast<unsigned char>(c);
    if (std::isalnum(letter)) plain += static_cast<char>(std::tolower(letter));
  }
  return plain;
}

int IdOfLabel(std::string_view label) {
  const auto found = std::ranges::find(kActions, label, &Action::label);
  return static_cast<int>(found - kActions.begin());
}

// kNumObjects if there is none.
int IdOfObject(std::string_view name) {
  return static_cast<int>(std::ranges::find(kObjects, name) - kObjects.begin());
}

// "drinks" -> "drinking", "uses" -> "using", "sets" -> "setting".
bool IsIngForm(std::string_view word, std::string_view label) {
  constexpr std::string_view kEnd = "ing";
  if (!word.ends_with(kEnd)) return false;
  const std::string_view stem = word.substr(0, word.size() - kEnd.size());
  if (stem == label) return true;
  if (label.ends_with('e') && stem == label.substr(0, label.size() - 1)) return true;
  return stem.size() == label.size() + 1 && stem.starts_with(label) && stem.back() == label.back();
}

// Finds an action by its label, verb or a form of it, then by aliases.
std::optional<int> MatchAction(std::string_view plain) {
  for (int id = 0; id < kNumActions; ++id) {
    const Action& action = kActions[static_cast<std::size_t>(id)];
    // "takes" alone is ambiguous.
    const bool short_form = action.label != "takepicture" && action.label != "switchON";
    if (plain == Plain(action.label) || plain == Plain(action.verb)) return id;
    const std::string first_word = Plain(action.verb.substr(0, action.verb.find(' ')));
    if (short_form && (plain == first_word || IsIngForm(plain, action.label))) return id;
  }
  for (const Alias& alias : kActionAliases) {
    if (plain == alias.name) return IdOfLabel(alias.known);
  }
  return std::nullopt;
}

std::optional<int> MatchObject(std::string_view plain) {
  if (const int id = IdOfObject(plain); id < kNumObjects) return id;
  for (const Alias& alias : kObjectAliases) {
    if (plain == alias.name) return IdOfObject(alias.known);
  }
  // "small cube": the vocabulary has the size after the shape.
  for (const std::string_view size : {"small", "medium", "large"}) {
    if (!plain.starts_with(size)) continue;
    const std::string turned = std::string(plain.substr(size.size())) + std::string(size);
    if (const int id = IdOfObject(turned); id < kNumObjects) return id;
  }
  return std::nullopt;
}

// Names listed in messages: those offered, or all if there are none.
std::vector<std::string_view> ActionLabels(std::span<const std::string_view> offered) {
  if (!offered.empty()) return {offered.begin(), offered.end()};
  std::vector<std::string_view> labels;
  for (const Action& action : kActions) labels.push_back(action.label);
  return labels;
}

// Suggests the known name with the smallest edit distance to any word of `words`, unless it is
// large.
[[noreturn]] void ThrowUnknown(std::string_view where, std::string_view what,
                               std::span<const std::string> words,
                               std::span<const std::string_view> known, std::string problem) {
  std::string_view nearest = known.front();
  int least = 1 << 20;
  for (const std::string& word : words) {
    if (word.size() < 3) continue;  // "he" is not a misspelled "see"
    for (const std::string_view name : known) {
      const int distance = EditDistance(word, Plain(name));
      if (distance >= least) continue;
      nearest = name;
      least = distance;
    }
  }
  const bool close = least <= std::max<int>(1, static_cast<int>(nearest.size()) / 3);
  std::string remedy = close ? fmt::format("Did you mean '{}'? ", nearest) : std::string();
  remedy += fmt::format("Known {}: {}", what, fmt::join(known, ", "));
  throw Error(where, problem, remedy);
}

std::vector<std::string> WordsOf(std::string_view sentence) {
  std::vector<std::string> words(1);
  for (const char c : sentence) {
    const auto letter = static_cast<unsigned char>(c);
    if (std::isalnum(letter)) {
      words.back() += static_cast<char>(std::tolower(letter));
    } else if (c != '-' && c != '_' && c != '\'' && !words.back().empty()) {
      words.emplace_back();
    }
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

struct Phrase {
  std::size_t begin = 0, length = 0;
  int id = 0;
  bool Overlaps(std::size_t other_begin, std::size_t other_length) const {
    return begin < other_begin + other_length && other_begin < begin + length;
  }
};

constexpr std::size_t kMaxPhraseWords = 4;  // "takes a picture with"

// The longest run of words that `match` knows; of equal lengths, the first or the last.
template <typename Match>
std::optional<Phrase> FindPhrase(const std::vector<std::string>& words, bool last,
                                 const std::optional<Phrase>& except, const Match& match) {
  for (std::size_t length = std::min(kMaxPhraseWords, words.size()); length > 0; --length) {
    std::optional<Phrase> found;
    for (std::size_t begin = 0; begin + length <= words.size(); ++begin) {
      if (except && except->Overlaps(begin, length)) continue;
      std::string joined;
      for (std::size_t i = begin; i < begin + length; ++i) joined += words[i];
      const std::optional<int> id = match(joined);
      if (id && (last || !found)) found = Phrase{begin, length, *id};
    }
    if (found) return found;
  }
  return std::nullopt;
}

// "sipping" or "sips" of "sip".
bool IsFormOf(std::string_view word, std::string_view known) {
  if (word == known || IsIngForm(word, known)) return true;
  if (!word.starts_with(known.substr(0, known.size() - 1))) return false;
  for (const std::string_view end : {"s", "es", "ed", "d"}) {
    if (word == std::string(known) + std::string(end)) return true;
  }
  return known.ends_with('y') && word == fmt::format("{}ies", known.substr(0, known.size() - 1));
}

struct WordsOfAction {
  int action = 0, weight = 0;  ///< largest of its words
  std::string words;
};

// Whether `known`, one word or two, is at this position.
bool IsAt(const std::vector<std::string>& words, std::size_t at, std::string_view known) {
  const std::size_t space = known.find(' ');
  if (!IsFormOf(words[at], known.substr(0, space))) return false;
  return space == std::string_view::npos ||
         (at + 1 < words.size() && words[at + 1] == known.substr(space + 1));
}

// The offered action (all if there are none) with the largest weight outside the object's name; of
// equals, the first in the sentence.
std::optional<WordsOfAction> FindByWords(const std::vector<std::string>& words,
                                         const std::optional<Phrase>& object,
                                         std::span<const std::string_view> offered) {
  std::vector<WordsOfAction> found;
  for (std::size_t at = 0; at < words.size(); ++at) {
    if (object && object->Overlaps(at, 1)) continue;
    for (const ActionWord& known : kActionWords) {
      if (!IsAt(words, at, known.words)) continue;
      if (!offered.empty() && std::ranges::find(offered, known.label) == offered.end()) continue;
      const int id = IdOfLabel(known.label);
      auto entry = std::ranges::find(found, id, &WordsOfAction::action);
      if (entry == found.end()) entry = found.insert(found.end(), {id, 0, {}});
      entry->weight = std::max(entry->weight, known.weight);
      entry->words += (entry->words.empty() ? "" : ", ") + words[at];
      if (known.words.find(' ') != std::string_view::npos) entry->words += " " + words[at + 1];
    }
  }
  const auto best = std::ranges::max_element(found, {}, &WordsOfAction::weight);
  return best == found.end() ? std::nullopt : std::optional(*best);
}

}  // namespace

std::span<const Action, kNumActions> Actions() { return kActions; }
std::span<const std::string_view, kNumObjects> Objects() { return kObjects; }

std::optional<int> FindAction(std::string_view name) { return MatchAction(Plain(name)); }
std::optional<int> FindObject(std::string_view name) { return MatchObject(Plain(name)); }

int ActionId(std::string_view name, std::string_view where,
             std::span<const std::string_view> offered) {
  if (const std::optional<int> id = FindAction(name)) return *id;
  const std::string plain = Plain(name);
  const std::vector<std::string_view> labels = ActionLabels(offered);
  ThrowUnknown(where, "actions", {&plain, 1}, labels, fmt::format("there is no action '{}'", name));
}

int ObjectId(std::string_view name, std::string_view where) {
  if (const std::optional<int> id = FindObject(name)) return *id;
  const std::string plain = Plain(name);
  ThrowUnknown(where, "objects", {&plain, 1}, kObjects,
               fmt::format("there is no object '{}'", name));
}

std::string_view EmbeddedMeshName(std::string_view vocabulary_name) {
  const auto found = std::ranges::find(kMeshes, vocabulary_name, &Alias::known);
  return found == kMeshes.end() ? vocabulary_name : found->name;
}

std::string_view VocabularyName(std::string_view embedded_mesh_name) {
  const auto found = std::ranges::find(kMeshes, embedded_mesh_name, &Alias::name);
  return found == kMeshes.end() ? embedded_mesh_name : found->known;
}

std::string SentenceOf(const Intent& intent) {
  return fmt::format("The person {} the {}.",
                     kActions.at(static_cast<std::size_t>(intent.action)).verb,
                     kObjects.at(static_cast<std::size_t>(intent.object)));
}

ParsedSentence ParseSentence(std::string_view sentence,
                             std::span<const std::string_view> offered_actions,
                             std::span<const std::string_view> offered_objects,
                             std::optional<int> known_action, std::optional<int> known_object) {
  const std::vector<std::string> words = WordsOf(sentence);
  const std::string where = fmt::format("\"{}\"", sentence);
  if (words.empty()) {
    throw Error(where, "it has no words", "Write, for example, \"drinks from the mug\"");
  }
  ParsedSentence parsed;
  const std::optional<Phrase> action = FindPhrase(words, false, std::nullopt, MatchAction);
  std::optional<Phrase> object = FindPhrase(words, true, action, MatchObject);
  // "dials with the phone": one word may name both.
  if (!object) object = FindPhrase(words, true, std::nullopt, MatchObject);
  const bool part = action && std::ranges::count(kPartsOfOthers, kActions[action->id].label) > 0;
  if (known_action) {
    parsed.action = *known_action;
  } else if (action && !part) {
    parsed.action = action->id;
  } else {
    const std::optional<WordsOfAction> by_words = FindByWords(words, object, offered_actions);
    if (by_words && (!action || by_words->weight > 1)) {
      parsed.action = by_words->action;
      parsed.because = by_words->words;
    } else if (action) {
      parsed.action = action->id;
    } else {
      ThrowUnknown(where, "actions", words, ActionLabels(offered_actions),
                   "none of its words is a known action");
    }
  }
  if (known_object) {
    parsed.object = *known_object;
    return parsed;
  }
  if (!object) {
    ThrowUnknown(
        where, "objects", words,
        offered_objects.empty() ? std::span<const std::string_view>(kObjects) : offered_objects,
        "none of its words is a known object");
  }
  parsed.object = object->id;
  return parsed;
}

std::optional<int> SimilarAction(int action, std::span<const std::string> offered) {
  const auto similar = std::ranges::find(kSimilar, Actions()[action].label, &Similar::label);
  if (similar == kSimilar.end()) return std::nullopt;
  for (const std::string_view label : {similar->first, similar->second}) {
    if (std::ranges::find(offered, label) != offered.end()) return IdOfLabel(label);
  }
  return std::nullopt;
}

}  // namespace holdfast::imos
