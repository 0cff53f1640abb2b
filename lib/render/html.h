// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Pieces of self-contained HTML pages: escaping, a page with the shared style (light and dark),
// tables.

#include <string>
#include <vector>

namespace tangible {

/// Text that is safe as an element's content and within a quoted attribute.
std::string HtmlEscape(const std::string& text);

/// A string as a JSON literal that is safe inside a <script> element: quotes included, every `<`
/// written as \u003c (so neither `</script>` nor `<!--` can occur), invalid UTF-8 replaced.
std::string ScriptString(const std::string& text);

/// A number for JSON and for readers, with `digits` significant digits in their shortest form; null
/// where it is not finite.
std::string CompactNumber(double value, int digits = 6);

/// A whole page: `title` is text, `body` is HTML. The style defines the colours that PlotSvg uses.
std::string HtmlPage(const std::string& title, const std::string& body);

/// A table of text cells (escaped), with a header row; cells that read as numbers are
/// right-aligned. Rows may be shorter than the header.
std::string HtmlTable(const std::vector<std::string>& header,
                      const std::vector<std::vector<std::string>>& rows);

}  // namespace tangible
