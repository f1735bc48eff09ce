#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "tests/client/fake_server.h"
#include "tests/client/temporary_directory.h"

namespace binpose::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

struct Output {
  int exit_code = 0;
  std::string out;
  std::string err;
};

/// The `binpose` command, run as a user runs it, against a server in this process.
class Cli : public ::testing::Test {
 protected:
  /// `files`: what follows the last option.
  Output run(const std::string& arguments, const std::vector<std::string>& files = {}) {
    std::ostringstream command;
    command << "BINPOSE_SERVER=" << server_.address() << " " << BINPOSE_COMMAND << " " << arguments;
    for (const std::string& file : files) command << " '" << file << "'";
    command << " >" << path("out") << " 2>" << path("err") << " </dev/null";
    const int status = std::system(command.str().c_str());  // NOLINT(cert-env33-c): a shell is what users have
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, files_.read("out"), files_.read("err")};
  }

  std::string path(const std::string& name) const { return (files_.path() / name).string(); }
  std::string file(const std::string& name, std::string_view bytes) const { return files_.write(name, bytes).string(); }

  static std::vector<v1::DetectResponse> parse_lines(const std::string& text) {
    std::vector<v1::DetectResponse> answers;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(line, &answers.emplace_back()).ok()) << line;
    }
    return answers;
  }

  /// A JSON object's fields have no order.
  static google::protobuf::Struct object_of(const std::string& text) {
    google::protobuf::Struct object;
    EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(text, &object).ok()) << text;
    return object;
  }

  FakeServer server_;
  TemporaryDirectory files_;
};

/// One part, turned by 90 degrees about z.
v1::DetectResponse one_part(const v1::DetectRequest& request) {
  v1::DetectResponse response;
  v1::PoseHypothesis& part = *response.add_hypotheses();
  part.set_model_id(request.model_ids(0));
  part.mutable_pose()->mutable_position()->set_x(1.25);
  part.mutable_pose()->mutable_position()->set_z(500);
  part.mutable_pose()->mutable_orientation()->set_z(0.70710678118654757);
  part.mutable_pose()->mutable_orientation()->set_w(0.70710678118654757);
  part.set_score(0.875);
  part.set_visible_fraction(0.5);
  part.set_confidence(1);
  response.mutable_stats()->set_total_seconds(0.0235);
  return response;
}

/// An error for the scene whose bytes are "# bad".
v1::DetectResponse refuse_bad(const v1::DetectRequest& request) {
  v1::DetectResponse response;
  if (request.cloud().pcd() != "# bad") return one_part(request);
  response.mutable_error()->set_code(3);
  response.mutable_error()->set_message("The cloud is bad.");
  return response;
}

TEST_F(Cli, HelpShowsExamplesAndExitCodes) {
  const Output help = run("--help");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, AllOf(HasSubstr("Examples:"), HasSubstr("Exit codes:"), HasSubstr("BINPOSE_SERVER")));
}

TEST_F(Cli, WrongUsageExitsWith2AndNamesTheOption) {
  EXPECT_EQ(run("").exit_code, 2);
  const Output output = run("detect --model gear --scene a.ply --unit cm");
  EXPECT_EQ(output.exit_code, 2);
  EXPECT_THAT(output.err, AllOf(HasSubstr("--unit"), HasSubstr("\"cm\"")));
  EXPECT_THAT(run("train --id gear --mesh a.stl").err, HasSubstr("--unit"));
}

TEST_F(Cli, NoServerExitsWith4AndNamesTheAddress) {
  const Output output = run("--server 127.0.0.1:1 models");
  EXPECT_EQ(output.exit_code, 4);
  EXPECT_THAT(output.err, AllOf(StartsWith("binpose: "), HasSubstr("127.0.0.1:1")));
}

TEST_F(Cli, TrainSendsTheMeshAndEveryParameter) {
  const Output output =
      run("train --id gear --unit mm --preset paper --selection observability --viewpoints 64 "
          "--pairs-per-point 0.5 --pair-lengths 0.4 0.2 --pair-lengths 0.3 0.1 --bin-width 10 "
          "--relative-sampling 0.05 --observability-weight 2 --distinctiveness-weight 3 --mesh",
          {file("gear.stl", "bytes")});
  EXPECT_EQ(output.exit_code, 0) << output.err;
  EXPECT_THAT(output.out, AllOf(StartsWith("trained gear in "), HasSubstr("diameter")));
  const v1::TrainRequest request = server_.train_request();
  EXPECT_EQ(request.mesh().data(), "bytes");
  EXPECT_EQ(request.mesh().unit(), v1::LENGTH_UNIT_MILLIMETRE);
  EXPECT_EQ(request.params().preset(), v1::TRAIN_PRESET_PAPER);
  EXPECT_EQ(request.params().selection(), v1::PAIR_SELECTION_OBSERVABILITY);
  EXPECT_EQ(request.params().viewpoint_count(), 64u);
  EXPECT_EQ(request.params().pairs_per_point(), 0.5);
  ASSERT_EQ(request.params().pair_lengths_size(), 2);
  EXPECT_EQ(request.params().pair_lengths(1).relative_q2(), 0.1);
  EXPECT_EQ(request.params().bin_width_degrees(), 10);
  EXPECT_EQ(request.params().relative_sampling(), 0.05);
  EXPECT_EQ(request.params().observability_weight(), 2);
  EXPECT_EQ(request.params().distinctiveness_weight(), 3);
}

TEST_F(Cli, TrainWithoutOptionsLeavesEveryParameterToTheServer) {
  ASSERT_EQ(run("train --id gear --unit m --mesh", {file("gear.stl", "bytes")}).exit_code, 0);
  EXPECT_EQ(server_.train_request().params().ByteSizeLong(), 0u);
}

TEST_F(Cli, TrainAsJsonPrintsTheModelAndNothingElse) {
  const Output output = run("train --json --id gear --unit mm --mesh", {file("gear.stl", "bytes")});
  v1::Model model;
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(output.out, &model).ok()) << output.out;
  EXPECT_EQ(model.id(), "gear");
  EXPECT_THAT(output.err, IsEmpty());
}

TEST_F(Cli, AMeshThatCannotBeReadExitsWith3) {
  const Output output = run("train --id gear --unit mm --mesh", {path("missing.stl")});
  EXPECT_EQ(output.exit_code, 3);
  EXPECT_THAT(output.err, HasSubstr("missing.stl"));
}

TEST_F(Cli, ARefusalExitsWith1AndGivesTheServersReason) {
  server_.call_status = {grpc::StatusCode::INVALID_ARGUMENT, "The mesh has no face."};
  const Output output = run("train --id gear --unit mm --mesh", {file("gear.stl", "bytes")});
  EXPECT_EQ(output.exit_code, 1);
  EXPECT_THAT(output.err, AllOf(HasSubstr("gear"), HasSubstr("The mesh has no face.")));
}

TEST_F(Cli, DetectPrintsATableOfPosesInMillimetresAndDegrees) {
  server_.answer = one_part;
  const Output output = run("detect --model gear --unit mm --scene", {file("bin.pcd", "#")});
  EXPECT_EQ(output.exit_code, 0) << output.err;
  EXPECT_EQ(output.out,
            path("bin.pcd") +
                ": 1 found in 23.5 ms\n"
                "rank  model  x mm  y mm    z mm  roll deg  pitch deg  yaw deg  score  visible  confidence\n"
                "   1  gear   1.25  0.00  500.00       0.0        0.0     90.0  0.875     0.50        1.00\n");
}

TEST_F(Cli, DetectSaysWhichPosesAreAmbiguous) {
  server_.answer = [](const v1::DetectRequest& request) {
    v1::DetectResponse response = one_part(request);
    *response.add_hypotheses() = response.hypotheses(0);
    response.mutable_hypotheses(1)->set_confidence(0.625);
    *response.mutable_hypotheses(1)->add_variants() = response.hypotheses(0).pose();
    return response;
  };
  EXPECT_THAT(run("detect --model gear --unit mm --scene", {file("bin.pcd", "#")}).out,
              AllOf(HasSubstr("        0.63\n"), HasSubstr("warning: ambiguous: 2 may")));
}

TEST_F(Cli, DetectInMetresPrintsMillimetresToo) {
  server_.answer = one_part;
  EXPECT_THAT(run("detect --model gear --unit m --scene", {file("bin.pcd", "#")}).out, HasSubstr("1250.00"));
}

TEST_F(Cli, DetectSendsEveryParameterAndAllScenesOverOneStream) {
  const Output output = run(
      "detect --model gear bolt --unit mm --max-results 5 --presence-score 0.2 --min-score 0 --start-point-share 0.5 "
      "--max-rejected 7 --normal-tolerance 15 --keep-support-plane --accept-ambiguous --sensor 10 -20 1500 --scene",
      {file("a.pcd", "# a"), file("b.ply", "ply\nb")});
  EXPECT_EQ(output.exit_code, 0) << output.err;
  EXPECT_EQ(server_.stream_count(), 1);
  const std::vector<v1::DetectRequest> requests = server_.detect_requests();
  ASSERT_EQ(requests.size(), 2u);
  EXPECT_EQ(requests[0].cloud().pcd(), "# a");
  EXPECT_EQ(requests[1].cloud().ply(), "ply\nb");
  EXPECT_EQ(requests[1].cloud().sensor_position().x(), 10);
  EXPECT_EQ(requests[1].cloud().sensor_position().y(), -20);
  EXPECT_EQ(requests[1].cloud().sensor_position().z(), 1500);
  const v1::DetectRequest& request = requests[0];
  EXPECT_THAT(request.model_ids(), ::testing::ElementsAre("gear", "bolt"));
  EXPECT_EQ(request.params().max_results(), 5u);
  EXPECT_EQ(request.params().presence_score(), 0.2);
  EXPECT_TRUE(request.params().has_min_score());
  EXPECT_EQ(request.params().max_rejected(), 7u);
  EXPECT_EQ(request.params().start_point_share(), 0.5);
  EXPECT_EQ(request.params().normal_tolerance_degrees(), 15);
  EXPECT_TRUE(request.params().has_remove_support_plane());
  EXPECT_FALSE(request.params().remove_support_plane());
  EXPECT_TRUE(request.params().accept_ambiguous());
}

TEST_F(Cli, ADepthImageIsSeenFromItsCameraAlone) {
  const std::string detect = "detect --model gear --unit mm --sensor 0 0 1000 --scene ";
  const Output folder = run(detect + BINPOSE_TEST_DATA "/scenes/bearing_support_01");
  EXPECT_EQ(folder.exit_code, 3);
  EXPECT_THAT(folder.err, AllOf(HasSubstr("bearing_support_01"), HasSubstr("leave out --sensor")));
  EXPECT_EQ(run(detect + "depth.png --camera camera.json").exit_code, 2);
}

TEST_F(Cli, AParamsFileSaysWhatHasNoOptionAndOptionsOverrideIt) {
  server_.answer = one_part;
  const std::string params = file(
      "cell.json", R"({"minScore": 0.7, "effort": "EFFORT_FAST", "regions": [{"size": {"x": 1, "y": 2, "z": 3}}]})");
  const std::string detect = "detect --model gear --unit mm --params " + params;
  ASSERT_EQ(run(detect + " --effort thorough --scene", {file("bin.pcd", "#")}).exit_code, 0);
  const v1::DetectParams sent = server_.detect_requests().at(0).params();
  EXPECT_EQ(sent.min_score(), 0.7);
  EXPECT_EQ(sent.effort(), v1::EFFORT_THOROUGH);
  ASSERT_EQ(sent.regions_size(), 1);
  EXPECT_EQ(sent.regions(0).size().y(), 2);

  const Output typo =
      run("detect --model gear --unit mm --params " + file("typo.json", R"({"minScor": 1})") + " --scene",
          {path("bin.pcd")});
  EXPECT_EQ(typo.exit_code, 3);
  EXPECT_THAT(typo.err, AllOf(HasSubstr("typo.json"), HasSubstr("minScor")));
}

TEST_F(Cli, ViewDrawsTheResultOfOneDetection) {
  if (run("detect --help").out.find("not in this build") != std::string::npos) GTEST_SKIP() << "built without viewer";
  server_.answer = [](const v1::DetectRequest& request) {
    v1::DetectResponse response = one_part(request);
    *response.add_rejected() = response.hypotheses(0);
    response.mutable_rejected(0)->set_score(0.125);
    return response;
  };
  const std::string detect = "detect --model gear --unit mm --view " + path("page.html");
  const Output output = run(detect + " --scene", {file("bin.pcd", "#")});
  EXPECT_EQ(output.exit_code, 0) << output.err;
  ASSERT_EQ(server_.detect_requests().size(), 1U);
  EXPECT_GT(server_.detect_requests()[0].params().max_rejected(), 0U);
  EXPECT_THAT(files_.read("page.html"), AllOf(HasSubstr("\"score\":0.875"), HasSubstr("\"score\":0.125")));
  run(detect + " --max-rejected 0 --scene", {path("bin.pcd")});
  EXPECT_EQ(server_.detect_requests().at(1).params().max_rejected(), 0U);
}

TEST_F(Cli, DetectAsJsonPrintsOneAnswerALineInTheOrderOfTheScenes) {
  server_.answer = one_part;
  const Output output = run("detect --json --model gear --unit mm --scene", {file("a.pcd", "#"), file("b.pcd", "#")});
  EXPECT_EQ(output.exit_code, 0) << output.err;
  const std::vector<v1::DetectResponse> answers = parse_lines(output.out);
  ASSERT_EQ(answers.size(), 2u);
  EXPECT_EQ(answers[0].request_id(), path("a.pcd"));
  EXPECT_EQ(answers[1].request_id(), path("b.pcd"));
  EXPECT_EQ(answers[1].hypotheses(0).score(), 0.875);
  EXPECT_THAT(output.out,
              AllOf(HasSubstr("\"visibleFraction\":0.5"), HasSubstr("\"totalSeconds\":0.0235"), HasSubstr("\"y\":0,")));
}

TEST_F(Cli, ABatchShowsItsProgressOnATerminalWhenItsAnswersGoElsewhere) {
  const std::string detect = "detect --model gear --unit mm --scene " + file("a.pcd", "#") + " " + file("b.pcd", "#");
  const auto typed = [&](const std::string& arguments) {
    const std::string command = "BINPOSE_SERVER=" + server_.address() + " script -qec '" BINPOSE_COMMAND " " +
                                arguments + "' " + path("typed") + " >/dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0);  // NOLINT(cert-env33-c)
    return files_.read("typed");
  };
  EXPECT_THAT(typed(detect + " >" + path("answers")),
              AllOf(HasSubstr("] 50 % " + path("a.pcd")), HasSubstr("] 100 %")));
  EXPECT_THAT(files_.read("answers"), AllOf(HasSubstr("b.pcd: nothing found"), Not(HasSubstr("%"))));
  EXPECT_THAT(typed(detect), AllOf(HasSubstr("b.pcd: nothing found"), Not(HasSubstr("] 50 %")))) << "one or the other";
  EXPECT_THAT(run(detect).err, IsEmpty());
}

TEST_F(Cli, AFailingSceneIsReportedAndTheOthersGoOn) {
  server_.answer = refuse_bad;
  const Output output =
      run("detect --model gear --unit mm --scene", {file("a.pcd", "#"), file("bad.pcd", "# bad"), file("c.pcd", "#")});
  EXPECT_EQ(output.exit_code, 1);
  EXPECT_THAT(output.err, AllOf(HasSubstr("bad.pcd"), HasSubstr("The cloud is bad."), Not(HasSubstr("c.pcd"))));
  EXPECT_THAT(output.out, AllOf(HasSubstr("a.pcd: 1 found"), HasSubstr("c.pcd: 1 found")));
}

TEST_F(Cli, AnUnreadableSceneExitsWith3AndTheOthersGoOn) {
  server_.answer = one_part;
  const Output output = run("detect --json --model gear --unit mm --scene", {path("missing.ply"), file("b.pcd", "#")});
  EXPECT_EQ(output.exit_code, 3);
  EXPECT_THAT(output.err, HasSubstr("missing.ply"));
  const std::vector<v1::DetectResponse> answers = parse_lines(output.out);
  ASSERT_EQ(answers.size(), 2u);
  EXPECT_TRUE(answers[0].has_error());
  EXPECT_EQ(answers[1].hypotheses_size(), 1);
}

TEST_F(Cli, ABrokenStreamExitsWith1AndSaysWhy) {
  server_.answers_before_end = 1;
  std::vector<std::string> scenes;
  scenes.reserve(20);
  for (int i = 0; i < 20; ++i) scenes.push_back(file(std::to_string(i) + ".pcd", "#"));
  const Output output = run("detect --model gear --unit mm --scene", scenes);
  EXPECT_EQ(output.exit_code, 1);
  EXPECT_THAT(output.err, HasSubstr("had enough"));
  EXPECT_THAT(output.out, AllOf(HasSubstr("0.pcd: nothing found"), Not(HasSubstr("/1.pcd: "))));
}

TEST_F(Cli, RequestPrintsTheJsonLineThatDetectWouldSend) {
  const Output output = run("request --model gear --unit mm --min-score 0 --scene", {file("a.pcd", "# a")});
  EXPECT_EQ(output.exit_code, 0) << output.err;
  EXPECT_EQ(server_.stream_count(), 0);
  EXPECT_EQ(std::count(output.out.begin(), output.out.end(), '\n'), 1);
  v1::DetectRequest request;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(output.out, &request).ok()) << output.out;
  EXPECT_EQ(request.cloud().pcd(), "# a");
  EXPECT_TRUE(request.params().has_min_score());
  EXPECT_FALSE(request.params().has_max_results());
}

TEST_F(Cli, ModelsListsShowsAndDeletes) {
  EXPECT_THAT(run("models").out, AllOf(HasSubstr("id"), HasSubstr("\nbolt"), HasSubstr("\ngear")));
  EXPECT_THAT(run("model gear").out, AllOf(HasSubstr("gear"), HasSubstr("100.0 mm")));
  EXPECT_EQ(run("delete gear").out, "deleted gear\n");
  EXPECT_THAT(run("models --json").out, HasSubstr("\"id\":\"gear\""));
}

TEST_F(Cli, ExportSaysWhereTheModelIs) {
  EXPECT_EQ(run("export gear", {path("gear.model")}).out, "exported gear to " + path("gear.model") + "\n");
  EXPECT_EQ(files_.read("gear.model"), "a model");
  const google::protobuf::Struct written = object_of(run("export --json gear", {path("gear.model")}).out);
  EXPECT_EQ(written.fields().at("file").string_value(), path("gear.model"));
  EXPECT_EQ(written.fields().at("fileBytes").number_value(), 7);
  EXPECT_EQ(run("export gear", {path("missing/gear.model")}).exit_code, 3);
}

TEST_F(Cli, EveryCommandTeachesByExamples) {
  for (const char* command : {"train", "detect", "models", "model", "delete", "export", "import", "watch", "bench",
                              "health", "request", "completion"}) {
    EXPECT_THAT(run(std::string(command) + " --help").out, HasSubstr("Examples:\n  ")) << command;
  }
}

TEST_F(Cli, WhatIsNotATerminalGetsNoColours) {
  EXPECT_THAT(run("--server 127.0.0.1:1 models").err, Not(HasSubstr("\033")));
}

TEST_F(Cli, ATerminalGetsColoursUnlessTheUserWantsNone) {
  const std::string command = "script -qec '" + std::string(BINPOSE_COMMAND) + " --server 127.0.0.1:1 models' ";
  EXPECT_EQ(std::system((command + path("typed")).c_str()) == 0, false);  // NOLINT(cert-env33-c)
  EXPECT_THAT(files_.read("typed"), HasSubstr("\033[31mbinpose: \033[0m"));
  EXPECT_NE(std::system(("NO_COLOR=1 " + command + path("plain")).c_str()), 0);  // NOLINT(cert-env33-c)
  EXPECT_THAT(files_.read("plain"), AllOf(HasSubstr("binpose: "), Not(HasSubstr("\033[31m"))));
}

TEST_F(Cli, HealthTellsByItsExitCodeWhetherTheServerServes) {
  EXPECT_EQ(run("health").out, "serving\n");
  EXPECT_EQ(run("health --server 127.0.0.1:1").exit_code, 4);
  server_.set_serving(false);
  const Output output = run("health");
  EXPECT_EQ(output.exit_code, 4);
  EXPECT_THAT(output.err, HasSubstr("takes no calls"));
}

TEST_F(Cli, BenchPrintsPercentiles) {
  server_.answer = one_part;
  const Output output =
      run("bench --model gear --unit mm --rate 50 --streams 2 --duration 0.1 --scene", {file("a.pcd", "# a")});
  EXPECT_EQ(output.exit_code, 0) << output.err;
  EXPECT_THAT(output.out, AllOf(HasSubstr(" of 5 scans answered"), HasSubstr("p99 ms"), HasSubstr("due to answer"),
                                HasSubstr("23.5")));
}

TEST_F(Cli, BenchAsJsonPrintsOneObject) {
  server_.answer = one_part;
  const Output output =
      run("bench --json --model gear --unit mm --rate 50 --duration 0.1 --scene", {file("a.pcd", "# a")});
  const google::protobuf::Struct report = object_of(output.out);
  EXPECT_EQ(report.fields().at("due").number_value(), 5);
  // On a machine that is busy the last ones may be late.
  EXPECT_EQ(report.fields().at("answered").number_value() + report.fields().at("unsent").number_value(), 5);
  EXPECT_EQ(report.fields().at("totalSeconds").struct_value().fields().at("p50").number_value(), 0.0235);
}

TEST_F(Cli, BenchPutsNoLoadOnAServerThatRefusesTheScan) {
  server_.answer = refuse_bad;
  const Output output = run("bench --model gear --unit mm --rate 50 --scene", {file("a.pcd", "# bad")});
  EXPECT_EQ(output.exit_code, 1);
  EXPECT_THAT(output.err, HasSubstr("The cloud is bad."));
  EXPECT_EQ(server_.detect_requests().size(), 1U);
}

TEST_F(Cli, WatchSearchesTheScansOfAFolderInTheOrderOfTheirTimes) {
  server_.answer = refuse_bad;
  file("first.pcd", "# first");
  file("second.pcd", "# bad");
  std::filesystem::last_write_time(path("first.pcd"),
                                   std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
  const Output output =
      run("watch --json --model gear --unit mm --existing --count 2 --interval 0.01 --dir", {files_.path().string()});
  EXPECT_EQ(output.exit_code, 0) << output.err;
  const std::vector<v1::DetectResponse> answers = parse_lines(output.out);
  ASSERT_EQ(answers.size(), 2U);
  EXPECT_EQ(answers[0].request_id(), path("first.pcd"));
  EXPECT_TRUE(answers[1].has_error());
  EXPECT_THAT(output.err, HasSubstr("The cloud is bad."));
}

TEST_F(Cli, WatchWaitsForAServerAndTriesAgain) {
  file("scan.pcd", "# scan");
  const std::string command = "timeout 2 " + std::string(BINPOSE_COMMAND) +
                              " watch --server 127.0.0.1:1 --model gear --unit mm --existing --interval 0.01 --dir " +
                              files_.path().string() + " 2>" + path("complaint");
  EXPECT_EQ(std::system(command.c_str()), 124 << 8);  // NOLINT(cert-env33-c): it was still waiting
  EXPECT_THAT(files_.read("complaint"), HasSubstr("127.0.0.1:1"));
}

TEST_F(Cli, WatchOfNoFolderExitsWith3) {
  EXPECT_EQ(run("watch --model gear --unit mm --dir", {path("missing")}).exit_code, 3);
}

/// What the shell prints for a script, with the command in its path and the server in its environment.
class Completion : public Cli {
 protected:
  std::string run_in(const std::string& shell, const std::string& script) {
    const std::string command = "PATH=$(dirname " BINPOSE_COMMAND "):$PATH BINPOSE_SERVER=" + server_.address() +
                                " TERM=dumb timeout 60 " + shell + " " + file("script", script) + " >" +
                                path("completed") + " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << shell;  // NOLINT(cert-env33-c)
    return files_.read("completed");
  }
};

TEST_F(Completion, OfBashKnowsCommandsOptionsWordsAndModels) {
  const auto complete = [&](const std::string& words, int last) {
    return run_in("bash", "source <(binpose completion); COMP_WORDS=(" + words +
                              "); COMP_CWORD=" + std::to_string(last) + "; _binpose; echo \"${COMPREPLY[@]}\"");
  };
  EXPECT_EQ(complete("binpose det", 1), "detect\n");
  EXPECT_EQ(complete("binpose detect --min", 2), "--min-score\n");
  EXPECT_EQ(complete("binpose train --unit m", 3), "m mm\n");
  EXPECT_EQ(complete("binpose detect --model ge", 3), "gear\n");
}

TEST_F(Completion, OfFishKnowsThemTooAndDescribesThem) {
  const auto complete = [&](const std::string& line) {
    return run_in("fish --no-config", "binpose completion --shell fish | source; complete -C '" + line + "'");
  };
  EXPECT_THAT(complete("binpose det"), StartsWith("detect\tFind parts"));
  EXPECT_THAT(complete("binpose detect --min"), StartsWith("--min-score\tLeave out"));
  EXPECT_THAT(complete("binpose train --unit "), AllOf(HasSubstr("m\t"), HasSubstr("mm\t")));
  EXPECT_THAT(complete("binpose detect --model ge"), StartsWith("gear\t"));
  EXPECT_THAT(complete("binpose delete ge"), StartsWith("gear"));
}

TEST_F(Completion, OfZshIsTypedByTheTabulator) {
  // A shell that believes itself at a terminal; each zpty -r waits for its pattern.
  const auto complete = [&](const std::string& typed, const std::string& pattern) {
    return run_in("zsh -f",
                  "zmodload zsh/zpty && zpty shell zsh -fi\n"
                  "zpty -w shell 'PS1=; autoload -U compinit && compinit -u -D &&"
                  " source <(binpose completion --shell zsh); echo rea\\dy'\n"
                  "zpty -r shell out '*ready*'\n"
                  "zpty -w -n shell '" +
                      typed +
                      "'$'\\t'\n"
                      "zpty -r shell out '*" +
                      pattern + "*' && print done");
  };
  EXPECT_EQ(complete("binpose det", "detect"), "done\n");
  EXPECT_EQ(complete("binpose detect --min", "--min-score"), "done\n");
  EXPECT_EQ(complete("binpose detect --model ge", "gear"), "done\n");
}

TEST_F(Cli, ServerOnTheCommandLineOverridesTheEnvironment) {
  FakeServer other;
  other.answer = one_part;
  const Output output =
      run("detect --server " + other.address() + " --model gear --unit mm --scene", {file("a.pcd", "#")});
  EXPECT_EQ(output.exit_code, 0) << output.err;
  EXPECT_EQ(other.stream_count(), 1);
  EXPECT_EQ(server_.stream_count(), 0);
}

}  // namespace
}  // namespace binpose::client
