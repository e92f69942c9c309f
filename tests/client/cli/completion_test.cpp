#include "client/cli/completion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client/cli/option_groups.h"
#include "common/cli/man_page.h"
#include "common/cli/program.h"

namespace slabstream {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class Completion : public testing::Test {
 protected:
  Completion() {
    const Command render = program_.AddCommand("render", "Render one picture");
    render.AddText("-o,--output", frame_.stats_path, "The picture").TypeName("FILE");
    AddFrameOptions(render, frame_);
    const Command data = program_.AddCommand("data", "Datasets");
    data.TakeCommand(true);
    data.AddCommand("list", "List them");
    data.AddCommand("remove", "Remove some");
    program_.AddCommand("secret", "Not for users").Group("");
    program_.AddCommand("help", "Explain").AddTexts("COMMAND", words_, "Which");
  }

  std::vector<std::string> Words(const std::vector<std::string>& typed) {
    std::vector<std::string> words;
    for (const Candidate& candidate : Complete(program_, typed, [this](const ServiceChoice& service) {
           asked_.push_back(service.endpoint);
           return std::vector<std::string>{"head", "heart"};
         })) {
      words.push_back(candidate.word);
    }
    return words;
  }

  const Program program_{"Slabstream renders.", "slabstream", "slabstream 1.0"};
  FrameOptions frame_;
  std::vector<std::string> words_, asked_;
};

TEST_F(Completion, OffersCommandsButNotHiddenOnes) {
  EXPECT_THAT(Words({""}), ElementsAre("render", "data", "help"));
  EXPECT_THAT(Words({"re"}), ElementsAre("render"));
  EXPECT_THAT(Words({"data", ""}), ElementsAre("list", "remove"));
  EXPECT_THAT(Words({"help", "d"}), ElementsAre("data"));
  EXPECT_THAT(Words({"help", "data", "r"}), ElementsAre("remove"));
  EXPECT_THAT(Words({}), IsEmpty());
}

TEST_F(Completion, OffersOptionsAndTheirValues) {
  EXPECT_THAT(Words({"render", "--rend"}), ElementsAre("--renderer"));
  EXPECT_THAT(Words({"render", "head", "--renderer", "r"}), ElementsAre("raycast"));
  EXPECT_THAT(Words({"render", "--renderer=ray"}), ElementsAre("--renderer=raycast"));
  EXPECT_THAT(Words({"render", "--transfer", "ct-b"}), Contains("ct-bone"));
  EXPECT_THAT(Words({"render", "--output", ""}), IsEmpty());  // a file
}

TEST_F(Completion, AsksTheNamedServiceForDatasets) {
  EXPECT_THAT(Words({"render", "--endpoint", "tcp://10.0.0.1:7420", "hea"}), ElementsAre("head", "heart"));
  EXPECT_THAT(Words({"render", "--endpoint=ipc://x", "--zoom", "2", "heart"}), ElementsAre("heart"));
  EXPECT_THAT(asked_, ElementsAre("tcp://10.0.0.1:7420", "ipc://x"));
  EXPECT_THAT(Words({"render", "head:ct-b"}), Contains("head:ct-bone"));
  EXPECT_THAT(Words({"render", "head", ""}), IsEmpty());  // there is one SOURCE
  EXPECT_THAT(asked_, testing::SizeIs(2));
}

TEST_F(Completion, ManualPagesEscapeWhatRoffWouldTake) {
  const Program app("Slabstream worker: renders.", "slabstream-worker", "1.0");
  std::string value;
  app.AddText("--at-once", value, ".begins with a dot, and \\ in it\n  on: always").Default("half of this machine's memory: 3 MiB");
  EXPECT_THAT(
      ManPage(app, "slabstream-worker"),
      AllOf(HasSubstr("slabstream\\-worker \\- renders\n"), HasSubstr(".B \\-\\-at\\-once"),
            HasSubstr("\\&.begins with a dot, and \\e in it (default: half of this machine's memory)\n"), HasSubstr(".B on\nalways\n")));
  EXPECT_THAT(ManPage(program_, "slabstream"), AllOf(HasSubstr(".BR slabstream\\-render (1)"), Not(HasSubstr("secret"))));
}

}  // namespace
}  // namespace slabstream
