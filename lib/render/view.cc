// SPDX-License-Identifier: Apache-2.0
#include "tangible/render/view.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>

#include "tangible/math/spline_curve.h"
#include "tangible/render/assets.h"
#include "tangible/render/html.h"

namespace tangible {
namespace {

const char* Name(Motion motion) {
  switch (motion) {
    case Motion::kStatic:
      return "static";
    case Motion::kKinematic:
      return "kinematic";
    default:
      return "moving";
  }
}

const char* Name(ShapeType type) {
  switch (type) {
    case ShapeType::kCircle:
      return "circle";
    case ShapeType::kEllipse:
      return "ellipse";
    case ShapeType::kBox:
      return "box";
    case ShapeType::kCapsule:
      return "capsule";
    case ShapeType::kPolygon:
      return "polygon";
    case ShapeType::kHalfPlane:
      return "half_plane";
    case ShapeType::kPolyline:
      return "polyline";
    case ShapeType::kSpline:
      return "spline";
    default:
      return "none";
  }
}

const char* Name(JointType type) {
  switch (type) {
    case JointType::kPrismatic:
      return "prismatic";
    case JointType::kWeld:
      return "weld";
    case JointType::kDistance:
      return "distance";
    case JointType::kRope:
      return "rope";
    case JointType::kFixedAngle:
      return "fixed_angle";
    case JointType::kCoupling:
    case JointType::kLimitedCoupling:
      return "coupling";
    default:
      return "revolute";
  }
}

/// Writes numbers and arrays of JSON, which are most of the page's size, without blanks.
class JsonWriter {
 public:
  void Raw(const std::string& text) { text_ += text; }
  void Number(double value) {
    Separate();
    text_ += CompactNumber(value);
  }
  void Text(const std::string& text) {
    Separate();
    text_ += ScriptString(text);
  }
  void Key(const std::string& key) {
    Separate();
    text_ += '"' + key + "\":";
  }
  void Open(char bracket) {
    Separate();
    text_ += bracket;
  }
  void Close(char bracket) { text_ += bracket; }
  const std::string& Result() const { return text_; }

 private:
  void Separate() {
    const char last = text_.empty() ? '[' : text_.back();
    if (last != '[' && last != '{' && last != ':') {
      text_ += ',';
    }
  }
  std::string text_;
};

void WriteVector(const Vector2<double>& v, JsonWriter* json) {
  json->Open('[');
  json->Number(v.x());
  json->Number(v.y());
  json->Close(']');
}

void WritePose(const Vector3<double>& pose, JsonWriter* json) {
  for (int i = 0; i < 3; ++i) {
    json->Number(pose[i]);
  }
}

/// The points between which a line looks like a spline's curve: each piece has one for every
/// kTurn rad by which it turns. Of a closed curve the first one is not repeated.
std::vector<double> DrawnCurve(const BasicShape<double>& shape) {
  constexpr double kTurn = 0.03;
  constexpr double kMostOfPiece = 100.0;
  std::vector<double> points = shape.numbers;
  if (shape.closed) points.insert(points.end(), {shape.numbers[0], shape.numbers[1]});
  const std::vector<double> m = SplineCurvatures(points);
  std::vector<double> drawn;
  for (std::size_t i = 0; i + 2 < points.size(); i += 2) {
    const SplinePiece<double> piece =
        MakePiece(points[i], points[i + 1], points[i + 2], points[i + 3], &m[i]);
    const int count =
        static_cast<int>(std::ceil(std::clamp(TurnOf(piece) / kTurn, 1.0, kMostOfPiece)));
    for (int k = 0; k < count; ++k) {
      const Vector2<double> at = piece.At(piece.length * k / count).place;
      drawn.insert(drawn.end(), {at.x(), at.y()});
    }
  }
  if (!shape.closed) drawn.insert(drawn.end(), points.end() - 2, points.end());
  return drawn;
}

/// Static bodies carry their pose; those that move have theirs in the frames.
void WriteBodies(const ViewData& data, const std::vector<ViewFrame>& frames, JsonWriter* json) {
  json->Key("bodies");
  json->Open('[');
  for (std::size_t i = 0; i < data.bodies.size(); ++i) {
    const ViewBody& body = data.bodies[i];
    json->Open('{');
    json->Key("name");
    json->Text(body.name);
    json->Key("motion");
    json->Text(Name(body.motion));
    json->Key("shape");
    json->Text(Name(body.shape.type));
    json->Key("numbers");
    json->Open('[');
    const bool is_spline = body.shape.type == ShapeType::kSpline;
    for (const double number : is_spline ? DrawnCurve(body.shape) : body.shape.numbers) {
      json->Number(number);
    }
    json->Close(']');
    if (is_spline || body.shape.type == ShapeType::kPolyline) {
      json->Key("closed");
      json->Number(body.shape.closed ? 1.0 : 0.0);
      json->Key("solid");
      json->Number(body.shape.solid == SolidSide::kLeft ? 1.0 : -1.0);
    }
    const auto write_points = [json](const char* key, const auto& points) {
      if (points.empty()) return;
      json->Key(key);
      json->Open('[');
      for (const Vector2<double>& point : points) WriteVector(point, json);
      json->Close(']');
    };
    write_points("points", body.contact_points);
    write_points("support", body.support_points);
    if (body.support_radius > 0.0) {
      json->Key("support_radius");
      json->Number(body.support_radius);
    }
    if (body.motion == Motion::kStatic) {
      json->Key("pose");
      json->Open('[');
      WritePose(frames.empty() ? Vector3<double>::Zero() : frames.front().poses[i], json);
      json->Close(']');
    }
    json->Close('}');
  }
  json->Close(']');
}

/// The members that joints and springs share; leaves the object open.
template <typename Link>
void WriteLink(const Link& link, JsonWriter* json) {
  json->Open('{');
  json->Key("name");
  json->Text(link.name);
  json->Key("bodies");
  json->Open('[');
  json->Number(link.bodies[0]);
  json->Number(link.bodies[1]);
  json->Close(']');
  json->Key("anchors");
  json->Open('[');
  WriteVector(link.anchors[0], json);
  WriteVector(link.anchors[1], json);
  json->Close(']');
}

void WriteLinks(const ViewData& data, JsonWriter* json) {
  json->Key("joints");
  json->Open('[');
  for (const ViewJoint& joint : data.joints) {
    WriteLink(joint, json);
    json->Key("type");
    json->Text(Name(joint.type));
    json->Key("axis");
    WriteVector(joint.axis, json);
    if (joint.rope > 0.0) {
      json->Key("rope");
      json->Number(joint.rope);
    }
    if (joint.has_motor) {
      json->Key("motor");
      json->Number(1.0);
    }
    if (joint.has_servo) {
      json->Key("servo");
      json->Number(1.0);
    }
    if (joint.until) {
      json->Key("until");
      json->Number(*joint.until);
    }
    json->Close('}');
  }
  json->Close(']');
  json->Key("springs");
  json->Open('[');
  for (const ViewSpring& spring : data.springs) {
    WriteLink(spring, json);
    json->Close('}');
  }
  json->Close(']');
}

void WriteContact(const ViewContact& contact, int mode, JsonWriter* json) {
  json->Open('[');
  for (const double number :
       {static_cast<double>(contact.bodies[0]), static_cast<double>(contact.bodies[1]),
        contact.point.x(), contact.point.y(), contact.normal.x(), contact.normal.y(),
        contact.normal_impulse, contact.tangential_impulse, static_cast<double>(mode)}) {
    json->Number(number);
  }
  json->Close(']');
}

void WriteContacts(const std::vector<ViewFrame>& frames, JsonWriter* json) {
  std::map<std::string, int> modes;
  std::vector<std::string> names;
  json->Key("contacts");
  json->Open('[');
  for (const ViewFrame& frame : frames) {
    json->Open('[');
    for (const ViewContact& contact : frame.contacts) {
      const auto [mode, is_new] = modes.emplace(contact.mode, static_cast<int>(names.size()));
      if (is_new) {
        names.push_back(contact.mode);
      }
      WriteContact(contact, mode->second, json);
    }
    json->Close(']');
  }
  json->Close(']');
  json->Key("modes");
  json->Open('[');
  for (const std::string& name : names) {
    json->Text(name);
  }
  json->Close(']');
}

void WriteSeries(const std::string& key, const std::vector<ViewFrame>& frames,
                 double ViewFrame::*member, JsonWriter* json) {
  json->Key(key);
  json->Open('[');
  for (const ViewFrame& frame : frames) {
    json->Number(frame.*member);
  }
  json->Close(']');
}

void WritePoses(const ViewData& data, const std::vector<ViewFrame>& frames, JsonWriter* json) {
  json->Key("poses");
  json->Open('[');
  for (const ViewFrame& frame : frames) {
    json->Open('[');
    for (std::size_t i = 0; i < data.bodies.size(); ++i) {
      if (data.bodies[i].motion != Motion::kStatic) {
        WritePose(frame.poses[i], json);
      }
    }
    json->Close(']');
  }
  json->Close(']');
}

/// Of each frame x and y of what was observed, then of what was fitted, of each place.
void WriteMarks(const std::vector<ViewFrame>& frames, JsonWriter* json) {
  const auto has_marks = [](const ViewFrame& frame) { return !frame.marks.empty(); };
  if (std::none_of(frames.begin(), frames.end(), has_marks)) return;
  json->Key("marks");
  json->Open('[');
  for (const ViewFrame& frame : frames) {
    json->Open('[');
    for (const ViewMark& mark : frame.marks) {
      for (const double number :
           {mark.observed.x(), mark.observed.y(), mark.fitted.x(), mark.fitted.y()}) {
        json->Number(number);
      }
    }
    json->Close(']');
  }
  json->Close(']');
}

std::string DataJson(const ViewData& data, const std::vector<ViewFrame>& frames) {
  JsonWriter json;
  json.Open('{');
  json.Key("name");
  json.Text(data.name);
  WriteBodies(data, frames, &json);
  WriteLinks(data, &json);
  WriteSeries("time", frames, &ViewFrame::time, &json);
  WriteSeries("kinetic", frames, &ViewFrame::kinetic_energy, &json);
  WriteSeries("potential", frames, &ViewFrame::potential_energy, &json);
  WritePoses(data, frames, &json);
  WriteContacts(frames, &json);
  WriteMarks(frames, &json);
  json.Close('}');
  return json.Result();
}

std::string Header(const ViewData& data, std::size_t num_kept) {
  std::string text = std::to_string(data.bodies.size()) + " bodies, " +
                     std::to_string(data.joints.size()) + " joints, gravity (" +
                     CompactNumber(data.gravity.x()) + ", " + CompactNumber(data.gravity.y()) +
                     ") m/s², ";
  text += num_kept == data.frames.size()
              ? std::to_string(num_kept) + " frames"
              : std::to_string(num_kept) + " of " + std::to_string(data.frames.size()) + " frames";
  return "<header><h1>" + HtmlEscape(data.name) + "</h1><span>" + text + "</span></header>\n";
}

// The page between the header and the scripts. Ids are those that view_controls.js looks up.
constexpr char kControls[] = R"html(
<div class="stage"><canvas id="stage"></canvas><div class="tip" id="tip"></div></div>
<div class="bar">
<button id="first" title="First frame (Home)">|◀</button>
<button id="back" title="One frame back (←)">◀</button>
<button id="play" class="play" title="Play or pause (space)">▶ Play</button>
<button id="forward" title="One frame on (→)">▶</button>
<button id="last" title="Last frame (End)">▶|</button>
<input id="slider" type="range" aria-label="time">
<output id="now"></output>
<select id="speed" title="Speed of the playback">
<option value="0.01">0.01 ×</option><option value="0.1">0.1 ×</option><option value="0.25">0.25 ×</option>
<option value="0.5">0.5 ×</option><option value="1" selected>1 ×</option><option value="2">2 ×</option>
<option value="5">5 ×</option></select>
<button id="zoom_out" title="Zoom out (-)">−</button>
<button id="zoom_in" title="Zoom in (+)">+</button>
<button id="fit" title="Show the whole motion (f)">Fit</button>
</div>
<div class="energy"><div class="key" id="energy-key"><span>energy (J)</span></div>
<div class="curves"><canvas id="energy"></canvas></div></div>
<div class="side">
<section class="legend"><h2>Legend</h2><div id="legend" style="display:block"></div>
<small id="impulse-scale"></small> <small id="residual-scale"></small></section>
<section>
<label><input type="checkbox" id="show_joints" checked>joints and springs</label>
<label><input type="checkbox" id="show_contacts" checked>contacts and impulses</label>
<label><input type="checkbox" id="show_names">names</label>
<label id="marks"><input type="checkbox" id="show_marks" checked>observed places, residuals</label></section>
<section class="contacts"><h2>Contacts <span id="contact-count"></span></h2>
<table><thead><tr><th>bodies</th><th>normal<br>N s</th><th>tangent<br>N s</th></tr></thead>
<tbody id="contact-rows"></tbody></table></section>
<section><small>Drag to move, wheel to zoom, point at a body for its name. Space plays, ← and → step.
Click the energy plot to go to a time.</small></section>
</div>
)html";

/// The data and what draws them.
std::string Scripts(const ViewData& data, const std::vector<ViewFrame>& frames) {
  return "<script type=\"application/json\" id=\"data\">" + DataJson(data, frames) +
         "</script>\n<script>\n" + kViewScript + "</script>\n";
}

}  // namespace

std::vector<ViewFrame> ThinFrames(const ViewData& data, const ViewOptions& options) {
  std::vector<const ViewFrame*> usable;
  std::size_t num_entries = 0;
  const auto num_moving = static_cast<std::size_t>(
      std::count_if(data.bodies.begin(), data.bodies.end(),
                    [](const ViewBody& body) { return body.motion != Motion::kStatic; }));
  for (const ViewFrame& frame : data.frames) {
    if (frame.poses.size() == data.bodies.size()) {
      usable.push_back(&frame);
      num_entries += num_moving + frame.contacts.size() + 1;
    }
  }
  const auto ratio = [](std::size_t a, std::size_t b) {
    return (a + b - 1) / std::max<std::size_t>(b, 1);
  };
  const std::size_t last = usable.empty() ? 0 : usable.size() - 1;
  const std::size_t room = options.max_frames > 1 ? options.max_frames - 1 : 1;
  const std::size_t stride =
      std::max<std::size_t>({1, ratio(last, room), ratio(num_entries, options.max_entries)});
  const auto impulse = [](const ViewFrame& frame) {
    double sum = 0.0;
    for (const ViewContact& contact : frame.contacts) {
      sum += contact.normal_impulse;
    }
    return sum;
  };
  std::vector<ViewFrame> kept;
  const ViewFrame* strongest = nullptr;
  for (std::size_t i = 0; i < usable.size(); ++i) {
    if (strongest == nullptr || impulse(*usable[i]) >= impulse(*strongest)) {
      strongest = usable[i];
    }
    if (i % stride == 0 || i == last) {
      kept.push_back(*usable[i]);
      kept.back().contacts = strongest->contacts;
      strongest = nullptr;
    }
  }
  return kept;
}

std::string ViewHtml(const ViewData& data, const ViewOptions& options) {
  const std::vector<ViewFrame> frames = ThinFrames(data, options);
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
      HtmlEscape(data.name) + "</title>\n<style>\n";
  html += kPageStyle;
  html += kViewStyle;
  html += "</style>\n</head>\n<body class=\"";
  html += options.below.empty() ? "view" : "view long";
  html += "\">\n<div class=\"app\">\n";
  html += Header(data, frames.size());
  html += "<noscript>This page draws with JavaScript, which is switched off.</noscript>";
  html += kControls;
  html += "</div>\n";
  if (!options.below.empty()) html += "<div class=\"below\">" + options.below + "</div>\n";
  return html + Scripts(data, frames) + "</body>\n</html>\n";
}

std::string ViewPart(const ViewData& data, const ViewOptions& options) {
  return std::string("<style>\n") + kViewStyle +
         "</style>\n<div class=\"view part\"><div class=\"app\">\n" + kControls + "</div></div>\n" +
         Scripts(data, ThinFrames(data, options));
}

}  // namespace tangible
