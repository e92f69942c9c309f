// Servers that speak TLS: whose certificates are believed, and what a user reads of those that are not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <future>
#include <memory>
#include <string>
#include <thread>

#include "common/base/check.h"
#include "data/stores/http_transfers.h"
#include "data/stores/store.h"
#include "tests/data/stores/scripted_server.h"
#include "tests/support/loopback_listener.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

template <class T, void (*kFree)(T*)>
struct Free {
  void operator()(T* object) const { kFree(object); }
};
using Key = std::unique_ptr<EVP_PKEY, Free<EVP_PKEY, EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Free<X509, X509_free>>;
using TlsContext = std::unique_ptr<SSL_CTX, Free<SSL_CTX, SSL_CTX_free>>;
using TlsConnection = std::unique_ptr<SSL, Free<SSL, SSL_free>>;

void Extend(X509& certificate, X509& issuer, int extension, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, &issuer, &certificate, nullptr, nullptr, 0);
  X509_EXTENSION* const made = X509V3_EXT_conf_nid(nullptr, &context, extension, value);
  CHECK(made != nullptr) << value;
  X509_add_ext(&certificate, made, -1);
  X509_EXTENSION_free(made);
}

struct Authority {
  Key key{EVP_EC_gen("P-256")};
  Certificate certificate;

  Authority() {
    certificate = Sign(*key, "an authority", 3600);
    Extend(*certificate, *certificate, NID_basic_constraints, "critical,CA:TRUE");
    X509_sign(certificate.get(), key.get(), EVP_sha256());
  }
  // A certificate of this machine that ends in so many seconds.
  Certificate ForThisMachine(EVP_PKEY& of, long seconds) const {
    Certificate made = Sign(of, "127.0.0.1", seconds);
    Extend(*made, *certificate, NID_subject_alt_name, "IP:127.0.0.1");
    X509_sign(made.get(), key.get(), EVP_sha256());
    return made;
  }
  void WriteTo(const std::string& path) const {
    std::FILE* const file = std::fopen(path.c_str(), "w");
    CHECK(file != nullptr) << path;
    CHECK_EQ(PEM_write_X509(file, certificate.get()), 1);
    CHECK_EQ(std::fclose(file), 0);
  }

 private:
  Certificate Sign(EVP_PKEY& of, const char* name, long seconds) const {
    Certificate made(X509_new());
    X509_set_version(made.get(), X509_VERSION_3);
    ASN1_INTEGER_set(X509_get_serialNumber(made.get()), seconds);
    X509_gmtime_adj(X509_getm_notBefore(made.get()), -7200);
    X509_gmtime_adj(X509_getm_notAfter(made.get()), seconds);
    X509_set_pubkey(made.get(), &of);
    X509_NAME* const subject = X509_get_subject_name(made.get());
    X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC, reinterpret_cast<const unsigned char*>(name), -1, -1, 0);
    X509_set_issuer_name(made.get(), certificate == nullptr ? subject : X509_get_subject_name(certificate.get()));
    return made;
  }
};

// Answers each connection once.
class TlsServer {
 public:
  TlsServer(X509& certificate, EVP_PKEY& key) : context_(SSL_CTX_new(TLS_server_method())) {
    CHECK_EQ(SSL_CTX_use_certificate(context_.get(), &certificate), 1);
    CHECK_EQ(SSL_CTX_use_PrivateKey(context_.get(), &key), 1);
    thread_ = std::jthread([this] {
      for (int connection = 0; (connection = ::accept(listener_.socket, nullptr, nullptr)) >= 0;) {
        Serve(connection);
        ::close(connection);
      }
    });
  }
  ~TlsServer() {
    ::shutdown(listener_.socket, SHUT_RDWR);
    thread_.join();
    ::close(listener_.socket);
  }
  TlsServer(const TlsServer&) = delete;
  TlsServer& operator=(const TlsServer&) = delete;

  std::string url() const { return "https://127.0.0.1:" + std::to_string(listener_.port); }

 private:
  void Serve(int connection) {
    const TlsConnection tls(SSL_new(context_.get()));
    SSL_set_fd(tls.get(), connection);
    if (SSL_accept(tls.get()) != 1) return;  // the client does not believe the certificate
    char request[4096];
    if (SSL_read(tls.get(), request, sizeof request) <= 0) return;
    const std::string answer = AnswerText("200 OK", "sealed", "Connection: close\r\n");
    SSL_write(tls.get(), answer.data(), int(answer.size()));
    SSL_shutdown(tls.get());
  }

  const TlsContext context_;
  const LoopbackListener listener_ = ListenOnLoopback();
  std::jthread thread_;
};

class TlsTest : public testing::Test {
 protected:
  TlsTest() { authority_.WriteTo(directory_ / "authority.pem"); }
  ~TlsTest() override { ::unsetenv("SSL_CERT_FILE"); }

  // What a server with a certificate of the authority's that ends in so many seconds sends, or why there is nothing.
  std::string Read(long seconds) {
    const Key key(EVP_EC_gen("P-256"));
    const Certificate certificate = authority_.ForThisMachine(*key, seconds);
    const TlsServer server(*certificate, *key);
    HttpTransfers transfers({});
    const Result<Bytes> bytes = ReadNow(**HttpStore(server.url() + "/scan", transfers), "0");
    if (!bytes.ok()) return bytes.status().message();
    return {reinterpret_cast<const char*>(bytes->span().data()), bytes->size()};
  }
  void TrustTheAuthority() const { ::setenv("SSL_CERT_FILE", (directory_ / "authority.pem").c_str(), 1); }

  const TemporaryDirectory directory_;
  const Authority authority_;
};

TEST_F(TlsTest, AuthoritiesAreTheSystemsOrThoseOfAFile) {
  EXPECT_THAT(Read(3600), HasSubstr("/scan/0: SSL certificate problem")) << "no authority of this system";
  TrustTheAuthority();
  EXPECT_EQ(Read(3600), "sealed");
}

TEST_F(TlsTest, ACertificateThatHasExpiredIsNamedAtOnce) {
  TrustTheAuthority();
  EXPECT_THAT(Read(-3600), testing::EndsWith("/scan/0: SSL certificate problem: certificate has expired"));
}

}  // namespace
}  // namespace slabstream
