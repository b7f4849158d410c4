// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// Iterates over the whitespace-separated words of a text and tracks the line, so that every error
/// names file and line. Accepts any line ending. Holds a view: the text must outlive it.
class TextScanner {
 public:
  /// `name` precedes the line number in messages. On each line, the text from the character
  /// `comment` on (if not 0) is skipped.
  TextScanner(std::string name, std::string_view text, char comment = '\0');

  bool AtEnd();                   ///< true if only blanks and comments are left
  std::string_view Peek();        ///< next word, empty at the end; does not advance
  std::string_view Next();        ///< next word, empty at the end
  std::string_view PeekOnLine();  ///< next word if it is on the current line, else empty
  std::string_view RestOfLine();  ///< up to the line's end, blanks trimmed

  /// Next word as a finite number; throws Error ("expected <what>, found ...").
  double Number(std::string_view what);
  /// Next word as a whole number in [lowest, highest]; throws Error.
  int Integer(std::string_view what, int lowest, int highest);
  /// Next word must be `word` (case ignored); throws Error.
  void Expect(std::string_view word, std::string_view context);

  int Line() const { return line_; }  ///< of the last word read, from 1
  std::string Where() const;          ///< "name:line"
  [[noreturn]] void Fail(std::string_view problem, std::string_view remedy) const;

 private:
  std::string_view WordAt(std::size_t position) const;
  void SkipBlanks(std::size_t& position, int& line, bool stay_on_line) const;

  std::string name_;
  std::string_view text_;
  char comment_;
  std::size_t position_ = 0;
  int line_ = 1;
};

/// Converts a text to the form that the scanner reads: UTF-16 with or without a byte order mark
/// becomes UTF-8, lone carriage returns that end lines become line feeds. `notes` reports both, and
/// a byte order mark. Bytes that are not such a text are returned unchanged.
std::string PlainText(std::string bytes, std::vector<std::string>& notes);

/// Appends a character, up to U+10FFFF.
void AppendUtf8(std::string& text, std::uint32_t code);

/// A text for messages: at most `longest` characters, and none that would garble a terminal.
std::string Excerpt(std::string_view text, std::size_t longest);

/// The first `most` names for messages: "a, b, ...".
std::string SomeNames(std::vector<std::string> names, std::size_t most);

/// Whether two words are equal, ignoring the case of ASCII letters.
bool EqualIgnoringCase(std::string_view a, std::string_view b);

/// Parses a whole word as a number; false if it is not one. Accepts a leading '+' and infinities.
bool ParseNumber(std::string_view word, double& value);

}  // namespace holdfast
