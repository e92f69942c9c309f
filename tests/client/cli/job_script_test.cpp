// The job script of `slabstream slurm`: what bash, shellcheck and Slurm make of it.
#include "client/cli/job_script.h"
#include "client/request/shell_word.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;
using testing::Not;

// Texts that a careless script would split, expand or end early.
const std::vector<std::string> kOddTexts = {"plain",  "",      "two words", "it's",    "\"quoted\"", "$HOME", "`id`",     "a\\b",
                                            "*.nrrd", "a;b",   "~",         "-o",      "#no",        "a\nb",  "\xc3\xa4", "!x",
                                            "'",      "''' '", "(x)",       "a>b<c|d", "{a,b}",      "[ab]",  " ",        "\t"};

// What a command prints; fails the test unless it exits with 0.
std::string OutputOf(const std::string& command) {
  std::string out;
  FILE* const pipe = ::popen(command.c_str(), "r");
  for (std::array<char, 4096> part{}; const std::size_t bytes = std::fread(part.data(), 1, part.size(), pipe);)
    out.append(part.data(), bytes);
  EXPECT_EQ(::pclose(pipe), 0) << command << ": " << out;
  return out;
}

bool IsInstalled(const std::string& program) { return std::system(("command -v " + program + " > /dev/null").c_str()) == 0; }

class JobScriptTest : public testing::Test {
 protected:
  // The path of a file that holds the text.
  std::string Written(const std::string& text) const {
    const std::string path = directory_ / "job.sh";
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }

  TemporaryDirectory directory_;
};

SlurmOptions SomeJob() { return {.data = {"head=/data/head.nrrd"}, .folder = "/shared/jobs"}; }
std::string TextOf(const SlurmOptions& options) { return JobScript(options, "head", "/opt/slabstream/bin"); }

TEST_F(JobScriptTest, BashReadsEveryPathAsItIs) {
  SlurmOptions job = SomeJob();
  std::string expected;
  for (const std::string& text : kOddTexts) job.data.push_back("x=/" + text);
  for (const std::string& data : job.data) expected += "--data\n" + data + "\n";
  const std::string programs = "/pro grams' of $HOME";
  job.folder = "/a shared `folder`";
  expected += programs + "\n" + job.folder + "/slabstream-17\n";
  // The values alone, printed a line each.
  std::string text = JobScript(job, "head", programs);
  const std::size_t body = text.find("\nservice_file()");
  ASSERT_NE(body, std::string::npos);
  text.resize(body);
  const std::string path = Written(text + "\nprintf '%s\\n' \"${data[@]}\" \"$programs\" \"$folder\"\n");
  EXPECT_EQ(OutputOf("SLURM_ARRAY_JOB_ID=17 SLURM_CPUS_ON_NODE=4 bash " + path), expected);
}

TEST_F(JobScriptTest, ShellWordsComeBack) {
  for (const std::string& text : kOddTexts)
    EXPECT_EQ(OutputOf("bash " + Written("printf '%s.' " + ShellWord(text))), text + ".") << ShellWord(text);
}

TEST_F(JobScriptTest, ShellcheckFindsNothing) {
  if (!IsInstalled("shellcheck")) GTEST_SKIP() << "needs shellcheck";
  SlurmOptions job = SomeJob();
  for (const std::string& text : kOddTexts) job.data.push_back("x=/" + text);
  for (const int threads : {0, 3}) {
    for (const char* folder : {"", "/a shared 'folder'"}) {
      job.threads = threads;
      job.folder = folder;
      // SC2016: a $ in single quotes stands for itself, as it should.
      EXPECT_EQ(OutputOf("shellcheck --shell=bash --exclude=SC2016 " + Written(TextOf(job))), "");
    }
  }
}

TEST_F(JobScriptTest, SlurmSeesTheOptions) {
  SlurmOptions job = SomeJob();
  job.nodes = 4;
  job.workers_per_node = 2;
  job.notice_seconds = 90;
  job.directives = {"--time=1:30:00", "--partition=long"};
  const std::string whole_nodes = TextOf(job);
  for (const char* line :
       {"--array=0-3", "--nodes=1", "--ntasks=2", "--time=1:30:00", "--signal=TERM@90", "--requeue", "--exclusive", "--partition=long"})
    EXPECT_THAT(whole_nodes, HasSubstr(std::string("\n#SBATCH ") + line + "\n"));
  EXPECT_THAT(whole_nodes, HasSubstr("\ndrain=68s ")) << "shorter than the notice";
  EXPECT_LT(whole_nodes.rfind("#SBATCH"), whole_nodes.find("set -u")) << "Slurm stops reading at the first command";
  EXPECT_GT(whole_nodes.find("--partition=long"), whole_nodes.find("--requeue")) << "of two options Slurm takes the later";
  job.threads = 3;
  EXPECT_THAT(TextOf(job), HasSubstr("\n#SBATCH --cpus-per-task=3\n"));
  EXPECT_THAT(TextOf(job), Not(HasSubstr("--exclusive")));
}

TEST(Directives, EndNoLineAndDecideNothingThatTheScriptDecides) {
  EXPECT_EQ(*ParseDirective("partition=long"), "--partition=long");
  EXPECT_EQ(*ParseDirective("--account=a b"), "--account=a b");
  EXPECT_EQ(*ParseDirective("exclusive"), "--exclusive");
  for (const char* text : {"array=0-3", "--array", "nodes=2", "ntasks=3", "mail-user=a\nrm x", "time=1\r", "a=\x7f"}) {
    const Status status = ParseDirective(text).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(status.message(), HasSubstr("of sbatch"));
    EXPECT_THAT(status.message(), Not(HasSubstr("\n")));
  }
}

}  // namespace
}  // namespace slabstream
