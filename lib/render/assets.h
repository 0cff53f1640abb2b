// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Texts that pages contain: style.css and the scripts of the viewer, which CMake turns into string
// literals.

namespace tangible {

extern const char kPageStyle[];   ///< style.css: colours and tables of every page
extern const char kViewStyle[];   ///< view.css: layout of the viewer
extern const char kViewScript[];  ///< view_canvas.js followed by view_controls.js

}  // namespace tangible
