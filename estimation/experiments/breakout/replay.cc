// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/breakout/replay.h"

#include <cmath>

#include "tangible/render/html.h"

namespace tangible {
namespace {

constexpr char kPlayer[] = R"(<p><canvas id="game" width="640" height="840"></canvas></p>
<p><button id="play">pause</button> <label>speed <select id="speed"><option>1</option>
<option selected>4</option><option>16</option></select></label>
<input id="time" type="range" min="0" value="0" style="width:24em"> <span id="text"></span></p>
<p>Space plays and pauses, the arrow keys go picture by picture. The mark below the paddle is where
the agent expects the ball.</p>
<script>
const canvas = document.getElementById('game'), pen = canvas.getContext('2d');
const play = document.getElementById('play'), time = document.getElementById('time');
const colours = ['#c84848', '#c66c3a', '#b47a30', '#a2a22a', '#48a048', '#4248c8'];
const scale = 4, width = 7, count = frames.length / width;
time.max = count - 1;
let now = Math.min(count - 1, Number((location.hash.match(/frame=(\d+)/) || [0, 0])[1]));
let playing = now == 0;
play.textContent = playing ? 'pause' : 'play';
function box(x, y, w, h, colour) {
  pen.fillStyle = colour;
  pen.fillRect(scale * x, scale * y, scale * w, scale * h);
}
function draw() {
  const [ballX, ballY, paddleX, paddleWidth, score, lives, expected] =
      frames.slice(width * now, width * now + width);
  box(0, 0, 160, 210, '#000');
  box(0, 17, 160, 15, '#8e8e8e');
  box(0, 32, 8, 178, '#8e8e8e');
  box(152, 32, 8, 178, '#8e8e8e');
  let bricks = '';
  for (const [frame, wall] of walls) {
    if (frame > now) break;
    bricks = wall;
  }
  for (let i = 0; i < bricks.length; ++i) {
    if (bricks[i] == '1') box(8 + i % 18 * 8, 57 + Math.floor(i / 18) * 6, 8, 6, colours[Math.floor(i / 18)]);
  }
  box(paddleX, 189, paddleWidth, 4, '#c84848');
  if (ballY > 0) box(ballX, ballY, 2, 4, '#c84848');
  if (expected >= 0) box(expected, 196, 2, 2, '#6aa1ff');
  pen.fillStyle = '#fff';
  pen.font = '40px monospace';
  pen.fillText(score + '   ' + lives, 40, 48);
  time.value = now;
  document.getElementById('text').textContent =
      (4 * now / 60).toFixed(1) + ' s, picture ' + now + ' of ' + (count - 1);
}
function step(by) {
  now = Math.max(0, Math.min(count - 1, now + by));
  draw();
}
function toggle() {
  playing = !playing;
  play.textContent = playing ? 'pause' : 'play';
}
play.onclick = toggle;
time.oninput = () => { now = Number(time.value); draw(); };
document.onkeydown = event => {
  if (event.key == ' ') toggle();
  else if (event.key == 'ArrowRight') step(1);
  else if (event.key == 'ArrowLeft') step(-1);
  else return;
  event.preventDefault();
};
let last = performance.now(), rest = 0;
function tick(at) {
  rest += playing ? (at - last) * 0.015 * Number(document.getElementById('speed').value) : 0;
  last = at;
  if (rest >= 1) {
    step(Math.floor(rest));
    rest -= Math.floor(rest);
  }
  requestAnimationFrame(tick);
}
draw();
requestAnimationFrame(tick);
</script>
)";

}  // namespace

void Replay::Add(const BreakoutGame& game, const Agent* agent) {
  const BreakoutGame::State& state = game.state();
  Frame frame;
  if (state.in_play) {
    frame.ball_x = state.ball_x;
    frame.ball_y = state.ball_y;
    if (agent != nullptr && agent->prediction() && agent->prediction()->arrives) {
      frame.expected = static_cast<int>(std::lround(agent->prediction()->end.at.x()));
    }
  }
  frame.paddle_x = state.paddle_x;
  frame.width = state.narrow ? breakout::kNarrowPaddleWidth : breakout::kPaddleWidth;
  frame.score = game.score();
  frame.lives = game.lives();
  std::string bricks(breakout::kBricks, '0');
  for (int i = 0; i < breakout::kBricks; ++i) bricks[i] = state.bricks[i] ? '1' : '0';
  if (walls_.empty() || walls_.back().bricks != bricks) walls_.push_back({frames_.size(), bricks});
  frames_.push_back(frame);
}

std::string Replay::Html(const std::string& title, const std::string& below) const {
  std::string script = "<script>\nconst frames = [";
  for (const Frame& frame : frames_) {
    for (const int number : {frame.ball_x, frame.ball_y, frame.paddle_x, frame.width, frame.score,
                             frame.lives, frame.expected}) {
      script += std::to_string(number);
      script += ',';
    }
  }
  script += "];\nconst walls = [";
  for (const Wall& wall : walls_) {
    script += '[';
    script += std::to_string(wall.frame);
    script += ",'";
    script += wall.bricks;
    script += "'],\n";
  }
  script += "];\n</script>\n";
  return HtmlPage(title, "<h1>" + HtmlEscape(title) + "</h1>\n" + script + kPlayer + below);
}

}  // namespace tangible
