// The job script of `slabstream slurm`, submitted to a real Slurm: pictures are those of one process, whatever Slurm does to the nodes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/base/time.h"
#include "common/json/json.h"
#include "tests/end_to_end/picture_file.h"
#include "tests/slurm/cluster.h"

namespace slabstream {
namespace {

constexpr int kNodes = 3;

class SlurmTest : public EndToEndTest {
 protected:
  void SetUp() override {
    Result<std::unique_ptr<SlurmCluster>> cluster = SlurmCluster::Start(directory_, kNodes);
    if (cluster.status().code() == StatusCode::kUnavailable) GTEST_SKIP() << cluster.status().message();
    ASSERT_TRUE(cluster.ok()) << cluster.status().message();
    cluster_ = *std::move(cluster);
    std::filesystem::create_directory(Path("shared folder"));
    MakeSphere("it's a ball.nrrd", 2, 48);
    // The same bits for any number of workers.
    MustRun({"render", Path("it's a ball.nrrd"), "--local=1", "-o", "expected.exr", "--renderer", "mip", "--size", "96"});
  }

  void TearDown() override {
    if (!HasFailure()) return;
    for (const std::string& name : Files())
      if (name.ends_with(".out")) std::cerr << "--- " << name << "\n" << ReadFile(name);
  }

  // Submits a service of so many nodes and waits for its workers on those that there are.
  void StartService(int nodes, const std::vector<std::string>& more = {}) {
    const int workers = std::min(nodes, kNodes);
    std::vector<std::string> command = {"slurm",         "--nodes",  std::to_string(nodes),   "--time",
                                        "1:00:00",       "--data",   "ball=it's a ball.nrrd", "--folder",
                                        "shared folder", "--sbatch", "partition=low"};
    command.insert(command.end(), more.begin(), more.end());
    std::ofstream(Path("job.sh")) << MustRun(command).out;
    job_ = cluster_->Output({"sbatch", "--parsable", "job.sh"});
    ASSERT_TRUE(Eventually([&] { return WorkerCount() == workers; })) << WorkerCount() << " of " << workers << " workers came";
  }

  std::string ServiceFile(const std::string& role) const { return Path("shared folder/slabstream-" + job_ + "/" + role + ".json"); }
  std::string Element(int index) const { return job_ + "_" + std::to_string(index); }
  // A field of squeue about an element of the job: %T state, %N node. Empty if it is not in the queue.
  std::string Ask(int element, const std::string& field) const {
    return cluster_->Output({"squeue", "-h", "-a", "-j", Element(element), "-o", field});
  }
  std::string Log(int element) const { return ReadFile("slurm-" + Element(element) + ".out"); }

  // -1: the service does not answer.
  int WorkerCount() const {
    const ProgramResult status = cluster_->Run(Command({"status", "--json", "--service", ServiceFile("client")}));
    return status.exit_status == 0 ? int(Json::Parse(status.out).value().at("workers").size()) : -1;
  }

  void ExpectThePicture() const {
    const ProgramResult rendered = cluster_->Run(
        Command({"render", "ball", "-o", "service.exr", "--renderer", "mip", "--size", "96", "--service", ServiceFile("client")}));
    ASSERT_EQ(rendered.exit_status, 0) << rendered.err;
    ASSERT_EQ(LargestDifference(ReadPicture(Path("service.exr")), ReadPicture(Path("expected.exr"))), 0);
  }

  // Pictures one after the other, and the right ones, until the condition holds.
  void RenderUntil(const std::function<bool()>& condition) const {
    ASSERT_TRUE(Eventually([&] {
      ExpectThePicture();
      return HasFailure() || condition();
    }));
  }

  // It was requeued.
  bool RunsAgain(int element) const {
    const std::string job = cluster_->Output({"scontrol", "show", "job", Element(element)});
    return job.find("Restarts=1") != std::string::npos && job.find("JobState=RUNNING") != std::string::npos;
  }

  std::unique_ptr<SlurmCluster> cluster_;
  std::string job_;
};

TEST_F(SlurmTest, AServiceRendersOnTheNodesThatThereAreAndEnds) {
  StartService(4);  // one of them waits in the queue
  // Sums of colours have the same bits for the same plan; another frame would have another display worker.
  std::vector<std::string> render = {"render", "ball", "-o", "splat.exr", "--size", "96", "--service", ServiceFile("client")};
  const std::vector<std::string> plan = {"--decomposition", "slab",  "--axis",        "y", "--groups", "1",
                                         "--combine",       "chain", "--pixel-error", "0"};
  render.insert(render.end(), plan.begin(), plan.end());
  ASSERT_EQ(cluster_->Run(Command(render)).exit_status, 0);
  render = {"render", Path("it's a ball.nrrd"), "--local=3", "-o", "local.exr", "--size", "96"};
  render.insert(render.end(), plan.begin(), plan.end());
  MustRun(render);
  EXPECT_EQ(LargestDifference(ReadPicture(Path("splat.exr")), ReadPicture(Path("local.exr"))), 0);
  ExpectThePicture();
  const std::string file = ServiceFile("client").substr(0, ServiceFile("client").find("shared folder")) + "shared\\ folder";
  EXPECT_THAT(Log(0), HasSubstr("slabstream render ball -o picture.png --service " + file)) << "what to type";
  EXPECT_THAT(Log(0), HasSubstr("ssh -N -L 7420:10.77.0.")) << "the address on the cluster's network";

  ASSERT_EQ(cluster_->Run(Command({"down", "--service", ServiceFile("admin")})).exit_status, 0);
  EXPECT_TRUE(Eventually([&] { return cluster_->Output({"squeue", "-h"}).empty(); }));
  const std::string jobs = cluster_->Output({"scontrol", "--oneliner", "show", "job", job_});
  const auto count = [&](const std::string& text) {
    int found = 0;
    for (std::size_t at = 0; (at = jobs.find(text, at)) != std::string::npos; ++at) ++found;
    return found;
  };
  EXPECT_EQ(count("JobState=COMPLETED"), 3) << jobs;
  EXPECT_EQ(count("JobState=CANCELLED"), 1) << jobs << ": the one that waited";
}

TEST_F(SlurmTest, APreemptedWorkerComesBackAndNoPictureSuffers) {
  StartService(3);
  const std::string node = Ask(1, "%N");
  const std::string other = cluster_->Output({"sbatch", "--parsable", "-p", "high", "-w", node, "--exclusive", "--wrap", "sleep 1000"});
  RenderUntil([&] { return WorkerCount() == 2; });
  EXPECT_EQ(Ask(1, "%T"), "RUNNING") << "it left with notice: the other job waits for the end of the grace time";
  RenderUntil([&] { return Ask(1, "%T") == "PENDING"; });
  EXPECT_TRUE(Eventually([&] { return cluster_->Output({"squeue", "-h", "-j", other, "-o", "%T %N"}) == "RUNNING " + node; }));
  cluster_->Output({"scancel", other});
  EXPECT_TRUE(Eventually([&] { return RunsAgain(1); }));
  RenderUntil([&] { return WorkerCount() == 3; });
}

TEST_F(SlurmTest, ARequeuedCoordinatorGetsItsWorkersBack) {
  StartService(3);
  ExpectThePicture();
  const std::string before = ReadFile("shared folder/slabstream-" + job_ + "/worker.json");
  cluster_->Output({"scontrol", "requeue", Element(0)});
  ASSERT_TRUE(Eventually([&] { return RunsAgain(0); })) << Ask(0, "%T %r");
  ASSERT_TRUE(Eventually([&] { return WorkerCount() == 3; })) << WorkerCount();
  EXPECT_NE(ReadFile("shared folder/slabstream-" + job_ + "/worker.json"), before);
  for (const int element : {1, 2}) EXPECT_EQ(Ask(element, "%T"), "RUNNING") << "it waited";
  ExpectThePicture();
}

TEST_F(SlurmTest, CancellingAnElementTakesItsWorkerAndCancellingTheJobEndsAll) {
  StartService(3);
  EXPECT_EQ(cluster_->CountPrograms("slabstream-"), 4);
  cluster_->Output({"scancel", Element(2)});
  RenderUntil([&] { return WorkerCount() == 2; });
  cluster_->Output({"scancel", job_});
  EXPECT_TRUE(Eventually([&] { return cluster_->Output({"squeue", "-h"}).empty(); }));
  EXPECT_EQ(WorkerCount(), -1);
  EXPECT_TRUE(Eventually([&] { return cluster_->CountPrograms("slabstream-") == 0; })) << "a program outlived its job";
}

TEST_F(SlurmTest, ADrainedNodeKeepsItsWorkerUntilTheElementMoves) {
  StartService(2);
  const std::string node = Ask(1, "%N");
  cluster_->Output({"scontrol", "update", "NodeName=" + node, "State=DRAIN", "Reason=test"});
  ExpectThePicture();
  EXPECT_EQ(WorkerCount(), 2);
  cluster_->Output({"scontrol", "requeue", Element(1)});
  RenderUntil([&] { return WorkerCount() == 1; });
  EXPECT_TRUE(Eventually([&] { return RunsAgain(1); }));
  EXPECT_NE(Ask(1, "%N"), node);
  RenderUntil([&] { return WorkerCount() == 2; });
  EXPECT_EQ(cluster_->Output({"sinfo", "-h", "-p", "low", "-n", node, "-o", "%T"}), "drained");
}

TEST_F(SlurmTest, TwoServicesShareNodesAndLoseOne) {
  StartService(3, {"--threads", "1"});
  const std::string first = job_;
  StartService(3, {"--threads", "1"});
  const std::string second = job_;
  // Each service, the nodes of its elements.
  std::map<std::string, std::vector<std::string>> nodes;
  for (const std::string& job : {first, second}) {
    job_ = job;
    for (int element = 0; element < 3; ++element) nodes[job].push_back(Ask(element, "%N"));
  }
  int lost = 0;  // a node without a coordinator
  while (SlurmCluster::NameOf(lost) == nodes[first][0] || SlurmCluster::NameOf(lost) == nodes[second][0]) ++lost;
  cluster_->LoseNode(lost);
  for (const auto& [job, elements] : nodes) {
    job_ = job;
    const auto gone = std::ranges::count(elements, SlurmCluster::NameOf(lost));
    RenderUntil([&] { return WorkerCount() == 3 - gone; });
  }
}

}  // namespace
}  // namespace slabstream
