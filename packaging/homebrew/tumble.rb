# Homebrew: the program. scripts/recipes.sh fills in the version and the archive of the sources.
class Tumble < Formula
  desc "@DESCRIPTION@"
  homepage "@HOMEPAGE@"
  url "@ARCHIVE_URL@"
  version "@VERSION@"
  sha256 "@SHA256@"
  license any_of: [@LICENSE_LIST@]

  depends_on "rust" => :build

  def install
    system "cargo", "install", *std_cargo_args(path: "cli")
    (man1/"tumble.1").write Utils.safe_popen_read(bin/"tumble", "man")
    generate_completions_from_executable(bin/"tumble", "completions")
    doc.install "README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT"
  end

  test do
    assert_match version.to_s, shell_output("#{bin}/tumble --version")
    system bin/"tumble", "generate", "-o", "chain.dat"
    system bin/"tumble", "verify", "chain.dat", "--device", "cpu", "-m", "slerp"
  end
end
