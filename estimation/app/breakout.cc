// SPDX-License-Identifier: Apache-2.0
//
// tangible-breakout: Breakout is learned from pictures and played by plans over what was learned,
// beside players that learn nothing.

#include <gflags/gflags.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "tangible/app/program.h"
#include "tangible/app/progress.h"
#include "tangible/estimation/experiments/breakout/breakout_study.h"
#include "tangible/estimation/experiments/breakout/replay.h"
#include "tangible/math/median.h"
#include "tangible/render/plot.h"
#include "tangible/scene/json_writer.h"

DEFINE_string(random_frames, "1000,200",
              "frames of random play, at 60 a second, before the agent plays");
DEFINE_double(sticky, 0.25,
              "chance that a button sticks for a frame, in games of their own; 0: none");
DEFINE_int32(games, 20, "of each player, with seeds that follow each other; with --quick 2");
DEFINE_int32(seed, 1, "of the first game");
DEFINE_int32(threads, 0, "0: one a core; results do not depend on it");
DEFINE_bool(quick, false, "short games, two unless --games is given, without the bounds");
DEFINE_string(out, "", "file of all results (JSON)");
DEFINE_string(plot, "", "file of reward and errors over frames (SVG)");
DEFINE_string(view, "", "file of the first learned game that is played (HTML)");

namespace tangible {
namespace {

// What must hold: the median score after so many frames of random play.
constexpr int kFrames = 1000, kFewFrames = 200;
constexpr double kMedian = breakout::kMostPoints, kFewMedian = 400.0;
// High reward, where errors are compared with those at the end.
constexpr int kHighScore = 400;
constexpr long kQuickFrames = 8000;  // of a game
constexpr int kQuickGames = 2;
constexpr int kPlotPoints = 120;

struct Published {
  const char* who;
  const char* score;
};
// Random, 31.8 and DQN (after 200 million frames): Mnih et al., Nature 518 (2015) 529, extended
// data table 2. 30.5 stands in the tables of the works with 100 000 steps, 400 000 frames: SPR,
// DreamerV3, IRIS, DIAMOND.
constexpr Published kPublished[] = {{"random", "1.7"},
                                    {"human", "30.5 or 31.8"},
                                    {"DQN, 200 million frames", "401.2"},
                                    {"SPR, 400 000 frames", "17.1"},
                                    {"DreamerV3, 400 000 frames", "31.0"},
                                    {"IRIS, 400 000 frames", "83.7"},
                                    {"DIAMOND, 400 000 frames", "132.5"}};

std::string NameOfCase(const BreakoutCase& one) {
  std::string name = NameOf(one.kind);
  if (one.kind == PlayerKind::kLearned) name += " after " + std::to_string(one.random_frames);
  if (one.sticky > 0.0) name += ", sticky " + FormatNumber(one.sticky);
  return name;
}

// The last point of a curve at or before so many frames.
const CurvePoint& At(const BreakoutResult& game, double frames) {
  const CurvePoint* last = &game.curve.front();
  for (const CurvePoint& point : game.curve) {
    if (static_cast<double>(point.frames_seen) <= frames) last = &point;
  }
  return *last;
}

// The first point of a curve with that score; null where the game never had it.
const CurvePoint* AtScore(const BreakoutResult& game, int score) {
  for (const CurvePoint& point : game.curve) {
    if (point.score >= score) return &point;
  }
  return nullptr;
}

void PrintTable(const BreakoutStudyOptions& options, const BreakoutResults& results) {
  std::printf("%-30s %7s %7s %5s %5s %9s   frames of 60 Hz in all\n", "player", "median", "mean",
              "least", "most", "games 864");
  for (size_t i = 0; i < results.size(); ++i) {
    const std::vector<BreakoutResult>& games = results[i];
    int least = breakout::kMostPoints, most = 0, complete = 0;
    double frames = 0.0;
    for (const BreakoutResult& game : games) {
      least = std::min(least, game.score);
      most = std::max(most, game.score);
      complete += game.score == breakout::kMostPoints ? 1 : 0;
      frames += static_cast<double>(game.frames) / static_cast<double>(games.size());
    }
    std::printf("%-30s %7.1f %7.1f %5d %5d %6d/%zu   %.0f a game\n",
                NameOfCase(options.cases[i]).c_str(), MedianScore(games), MeanScore(games), least,
                most, complete, games.size(), frames);
  }
  std::printf(
      "published, means of games of up to five lives with 0 to 30 no-ops, 4 frames a step:\n");
  for (const Published& one : kPublished) std::printf("  %-28s %s\n", one.who, one.score);
  std::fflush(stdout);
}

// One line of the table of learning: the medians of a number at the start of the games, at high
// reward, where games came to it, and at their end; `settled` is that at the end of these alone.
struct LearningLine {
  double start = NAN, high = NAN, end = NAN, settled = NAN;
};

template <typename Value>
LearningLine PrintLearningLine(const char* what, const std::vector<BreakoutResult>& games,
                               int random_frames, const Value& value) {
  std::vector<double> start, high, end, settled;
  for (const BreakoutResult& game : games) {
    size_t first = 0;
    while (game.curve[first].frames_seen < random_frames && first + 1 < game.curve.size()) ++first;
    start.push_back(value(game.curve[first]));
    end.push_back(value(game.curve.back()));
    const CurvePoint* point = AtScore(game, kHighScore);
    if (point == nullptr) continue;
    high.push_back(value(*point));
    settled.push_back(value(game.curve.back()));
  }
  const LearningLine line{Median(start), Median(high), Median(end), Median(settled)};
  std::printf("  %-46s %8.3g ", what, line.start);
  if (high.empty()) {
    std::printf("%8s", "-");
  } else {
    std::printf("%8.3g", line.high);
  }
  std::printf(" %8.3g\n", line.end);
  return line;
}

// How far learning was at its start, at high reward and at the end of the games.
bool PrintLearning(const BreakoutStudyOptions& options, const BreakoutResults& results) {
  bool holds = true;
  for (size_t i = 0; i < results.size(); ++i) {
    if (options.cases[i].kind != PlayerKind::kLearned) continue;
    const std::vector<BreakoutResult>& games = results[i];
    const auto reached = std::count_if(games.begin(), games.end(), [](const BreakoutResult& game) {
      return AtScore(game, kHighScore) != nullptr;
    });
    std::printf("%s: medians at the game's start, at %d points (%ld of %zu games), at its end\n",
                NameOfCase(options.cases[i]).c_str(), kHighScore, static_cast<long>(reached),
                games.size());
    const auto line = [&](const char* what, const auto& value) {
      return PrintLearningLine(what, games, options.cases[i].random_frames, value);
    };
    line("frames seen", [](const CurvePoint& p) { return static_cast<double>(p.frames_seen); });
    line("error of the paddle's way in a step (pixels)",
         [](const CurvePoint& p) { return p.errors.paddle_way; });
    const LearningLine returns = line("share of returns expected wrong",
                                      [](const CurvePoint& p) { return p.errors.returns; });
    const LearningLine bricks = line("share of bricks' speeds expected wrong",
                                     [](const CurvePoint& p) { return p.errors.bricks; });
    if (options.most_frames < breakout::kMostFrames) continue;
    holds = PrintBound(returns.end < returns.start && bricks.end < bricks.start,
                       "  what was learned in the game is better than what was before") &&
            holds;
    if (reached == 0) continue;
    holds = PrintBound(returns.high > returns.settled || bricks.high > bricks.settled,
                       "  high reward comes before it has settled") &&
            holds;
  }
  return holds;
}

bool PrintBounds(const BreakoutStudyOptions& options, const BreakoutResults& results) {
  bool holds = true;
  for (size_t i = 0; i < results.size(); ++i) {
    const BreakoutCase& one = options.cases[i];
    if (one.kind != PlayerKind::kLearned || one.sticky > 0.0) continue;
    const double median = MedianScore(results[i]);
    if (one.random_frames == kFrames) {
      holds = PrintBound(median >= kMedian, NameOfCase(one) + ": 864 in the median") && holds;
    } else if (one.random_frames == kFewFrames) {
      holds =
          PrintBound(median > kFewMedian, NameOfCase(one) + ": above 400 in the median") && holds;
    }
  }
  return holds;
}

OrderedJson DescribeErrors(const KnowledgeErrors& errors) {
  return {{"paddle_way", errors.paddle_way},
          {"returns", errors.returns},
          {"bricks", errors.bricks},
          {"points", errors.points}};
}

OrderedJson DescribeGame(const BreakoutResult& game) {
  OrderedJson json = {{"seed", game.seed},     {"no_op_frames", game.no_op_frames},
                      {"score", game.score},   {"lives", game.lives},
                      {"frames", game.frames}, {"random_aims", game.random_aims}};
  if (game.curve.empty()) return json;
  json["curve"] = OrderedJson::array();
  for (const CurvePoint& point : game.curve) {
    OrderedJson one = {{"frames_seen", point.frames_seen},
                       {"score", point.score},
                       {"errors", DescribeErrors(point.errors)}};
    for (int i = 0; i < kNumPaddleNumbers; ++i) {
      one["paddle"][kPaddleNumberNames[i]] = point.numbers[i];
    }
    json["curve"].push_back(one);
  }
  return json;
}

OrderedJson Describe(const BreakoutStudyOptions& options, const BreakoutResults& results) {
  OrderedJson json = {{"games", options.games},
                      {"seed", options.seed},
                      {"most_frames", options.most_frames},
                      {"players", OrderedJson::array()},
                      {"published", OrderedJson::array()}};
  for (size_t i = 0; i < results.size(); ++i) {
    OrderedJson one = {{"player", NameOf(options.cases[i].kind)},
                       {"sticky", options.cases[i].sticky},
                       {"median", MedianScore(results[i])},
                       {"mean", MeanScore(results[i])},
                       {"games", OrderedJson::array()}};
    if (options.cases[i].kind == PlayerKind::kLearned) {
      one["random_frames"] = options.cases[i].random_frames;
    }
    for (const BreakoutResult& game : results[i]) one["games"].push_back(DescribeGame(game));
    json["players"].push_back(one);
  }
  for (const Published& one : kPublished) {
    json["published"].push_back({{"player", one.who}, {"score", one.score}});
  }
  return json;
}

// The first learned case.
std::string LearningPlot(const BreakoutStudyOptions& options, const BreakoutResults& results) {
  size_t learned = 0;
  while (options.cases[learned].kind != PlayerKind::kLearned) ++learned;
  const std::vector<BreakoutResult>& games = results[learned];
  long last = 0;
  double first_way = 0.0;
  for (const BreakoutResult& game : games) {
    last = std::max(last, game.curve.back().frames_seen);
    first_way = std::max(first_way, game.curve.front().errors.paddle_way);
  }
  const auto series = [&](const std::string& label, const auto& value) {
    PlotSeries one;
    one.label = label;
    const double least = 100.0;  // frames; the axis is logarithmic
    for (int i = 0; i <= kPlotPoints; ++i) {
      const double frames =
          least * std::pow(static_cast<double>(last) / least, static_cast<double>(i) / kPlotPoints);
      one.x.push_back(frames);
      std::vector<double> values;
      values.reserve(games.size());
      for (const BreakoutResult& game : games) values.push_back(value(At(game, frames)));
      one.y.push_back(Median(std::move(values)));
    }
    return one;
  };
  return PlotSvg(
      {.title = "Breakout, " + NameOfCase(options.cases[learned]) + " random frames: medians of " +
                std::to_string(games.size()) + " games",
       .x_label = "frames seen, at 60 a second",
       .y_label = "share",
       .x_scale = AxisScale::kLogarithmic},
      {series("score / 864",
              [](const CurvePoint& p) {
                return static_cast<double>(p.score) / breakout::kMostPoints;
              }),
       series("error of the paddle's way / first",
              [&](const CurvePoint& p) { return p.errors.paddle_way / first_way; }),
       series("returns expected wrong", [](const CurvePoint& p) { return p.errors.returns; }),
       series("bricks' speeds expected wrong",
              [](const CurvePoint& p) { return p.errors.bricks; })});
}

std::string View(const BreakoutStudyOptions& options, const BreakoutResults& results) {
  size_t learned = 0;
  while (options.cases[learned].kind != PlayerKind::kLearned) ++learned;
  Replay replay;
  const BreakoutResult game =
      PlayBreakout(options.cases[learned], options.seed, options.most_frames,
                   [&](const BreakoutGame& now, const Agent* agent) { replay.Add(now, agent); });
  return replay.Html("Breakout, " + NameOfCase(options.cases[learned]) + " random frames, seed " +
                         std::to_string(game.seed) + ": " + std::to_string(game.score) + " points",
                     LearningPlot(options, results));
}

std::string CheckFlags(BreakoutStudyOptions* options) {
  std::string outside = FirstOutside({{"--games", FLAGS_games, 1, 10000},
                                      {"--seed", FLAGS_seed, 0},
                                      {"--threads", FLAGS_threads, 0, kMostThreads}});
  if (!outside.empty()) return outside;
  if (!(FLAGS_sticky >= 0.0 && FLAGS_sticky < 1.0)) {
    return "--sticky: expected a number >= 0 and < 1, got " + FormatNumber(FLAGS_sticky);
  }
  const std::vector<int> random_frames = WholeNumbersAtCommas(FLAGS_random_frames, 0, 1000000);
  if (random_frames.empty() || std::any_of(random_frames.begin(), random_frames.end(),
                                           [](int count) { return count % kFrameSkip != 0; })) {
    return "--random_frames: expected multiples of 4 from 0 to 1000000, got " + FLAGS_random_frames;
  }
  using enum PlayerKind;
  options->cases = {{kRandom, 0, 0.0}, {kFollow, 0, 0.0}, {kIntercept, 0, 0.0}, {kTruth, 0, 0.0}};
  for (const int frames : random_frames) options->cases.push_back({kLearned, frames, 0.0});
  if (FLAGS_sticky > 0.0) {
    options->cases.push_back({kIntercept, 0, FLAGS_sticky});
    options->cases.push_back({kTruth, 0, FLAGS_sticky});
    options->cases.push_back({kLearned, random_frames.front(), FLAGS_sticky});
  }
  options->games = FLAGS_games;
  options->seed = static_cast<unsigned>(FLAGS_seed);
  options->threads = FLAGS_threads;
  if (FLAGS_quick) {
    if (gflags::GetCommandLineFlagInfoOrDie("games").is_default) options->games = kQuickGames;
    options->most_frames = kQuickFrames;
  }
  return "";
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-breakout",
       .synopsis = "[--games=20] [--random_frames=1000,200] [--sticky=0.25] [--seed=1] [--quick] "
                   "[--out=R.json] [--plot=P.svg] [--view=V.html]",
       .description =
           "Learns Breakout from pictures: how the paddle answers and the ball rebounds, from "
           "random play\nand while it plays, with predictions by event stepping and plans by "
           "iLQR, beside players that\nlearn nothing. Exits with 1 where a bound that it prints "
           "does not hold.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .num_positional = 0,
       .outputs = {"out", "plot", "view"}});
  if (line.exit_status) return *line.exit_status;
  BreakoutStudyOptions options;
  const std::string wrong = CheckFlags(&options);
  if (!wrong.empty()) return ReportError("tangible-breakout: " + wrong, kExitUsage);
  BreakoutResults results;
  {
    Progress progress("games", static_cast<long>(options.cases.size()) * options.games);
    results = RunBreakout(options, [&](long done, long) { progress.Show(done); });
  }
  for (const std::vector<BreakoutResult>& games : results) {
    for (const BreakoutResult& game : games) {
      if (!game.error.empty()) return ReportError("tangible-breakout: " + game.error);
    }
  }
  PrintTable(options, results);
  bool holds = PrintLearning(options, results);
  if (!FLAGS_quick) holds = PrintBounds(options, results) && holds;
  ResultWriter writer;
  writer.Write(FLAGS_out, [&] { return JsonText(Describe(options, results)); });
  writer.Write(FLAGS_plot, [&] { return LearningPlot(options, results); });
  writer.Write(FLAGS_view, [&] { return View(options, results); });
  if (!writer.error().empty()) return ReportError(writer.error());
  return holds ? kExitDone : kExitFailed;
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
