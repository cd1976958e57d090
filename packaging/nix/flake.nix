# Nix: the program. `nix run 'git+file:.?dir=packaging/nix' -- --version` in a clone; the version is that of Cargo.toml.
{
  description = "Bulk interpolation of rotations: Vulkan compute and the CPU, with the same bits";

  inputs.nixpkgs.url = "github:NixOS/nixpkgs/nixos-unstable";

  outputs = { self, nixpkgs }:
    let
      source = ../..;
      cargo = builtins.fromTOML (builtins.readFile (source + "/Cargo.toml"));
      manifest = cargo.workspace.package;
      systems = [ "x86_64-linux" "aarch64-linux" "x86_64-darwin" "aarch64-darwin" ];
      each = nixpkgs.lib.genAttrs systems;
    in
    {
      packages = each (system:
        let
          pkgs = nixpkgs.legacyPackages.${system};
        in
        {
          default = pkgs.rustPlatform.buildRustPackage {
            pname = "tumble";
            version = manifest.version;
            src = source;
            cargoLock.lockFile = source + "/Cargo.lock";
            cargoBuildFlags = [ "-p" "tumble-cli" "--bin" "tumble" ];
            # The tests need the whole repository, browsers and drivers.
            doCheck = false;
            nativeBuildInputs = [ pkgs.installShellFiles pkgs.makeWrapper ];
            postInstall = ''
              $out/bin/tumble man > tumble.1
              installManPage tumble.1
              installShellCompletion --cmd tumble \
                --bash <($out/bin/tumble completions bash) \
                --zsh <($out/bin/tumble completions zsh) \
                --fish <($out/bin/tumble completions fish)
              # Vulkan's loader is found at run time, if there is one.
              wrapProgram $out/bin/tumble --suffix LD_LIBRARY_PATH : ${pkgs.lib.makeLibraryPath [ pkgs.vulkan-loader ]}
            '';
            meta = {
              description = cargo.package.description;
              license = with pkgs.lib.licenses; [ mit asl20 ];
              mainProgram = "tumble";
            };
          };
        });
    };
}
