// The menus that build recipes. Written by fire-atlas plugin unity.

namespace FireAtlas.Editor
{
    using global::System.Collections.Generic;
    using global::System.ComponentModel;
    using global::System.IO;
    using global::System.Linq;
    using global::UnityEditor;
    using global::UnityEngine;

    /// <summary>Builds recipes from the editor's menus, and shows progress and advice.</summary>
    public static class RecipeMenu
    {
        const string BuildSelected = "Assets/Fire Atlas/Build Selected Recipes";
        const string BuildAll = "Tools/Fire Atlas/Build All .fire Recipes";

        const string NotFound = "Fire Atlas: there is no program {0}. Install it with: "
            + "pip install ./fire-atlas (in the folder that holds its checkout; Python 3.11 or later). If it is installed, or lies in the project, state its path in Preferences > Fire Atlas.";

        const string NoPrefab = "{0}: was built, but has no prefab; add unity to its exports: exports: [unity]";

        static RecipeBuild build;
        static int progress;
        static bool reported;
        static string[] waiting = new string[0];

        /// <summary>Whether a build is running.</summary>
        public static bool Running
        {
            get { return build != null; }
        }

        [MenuItem(BuildSelected, true)]
        static bool CanBuildSelected()
        {
            return !Running && Selected().Any();
        }

        /// <summary>Builds the selected recipes, and all recipes of the selected folders.</summary>
        [MenuItem(BuildSelected)]
        public static void StartSelected()
        {
            Build(Selected().ToArray());
        }

        [MenuItem(BuildAll, true)]
        static bool CanBuildAll()
        {
            return !Running;
        }

        /// <summary>Builds every .fire recipe below Assets. Other YAML may be no recipe.</summary>
        [MenuItem(BuildAll)]
        public static void StartAll()
        {
            string[] found = Directory.GetFiles(Application.dataPath, "*.fire", SearchOption.AllDirectories);
            string[] recipes = found.Select(InProject).OrderBy(path => path, System.StringComparer.Ordinal).ToArray();
            if (recipes.Length == 0) Debug.LogWarning("Fire Atlas: there is no recipe that ends in .fire below Assets");
            else Build(recipes);
        }

        /// <summary>Returns the selected recipes and folders, as paths in the project.</summary>
        public static IEnumerable<string> Selected()
        {
            return Selection.assetGUIDs.Select(AssetDatabase.GUIDToAssetPath)
                .Where(path => RecipeBuild.IsRecipe(path) || AssetDatabase.IsValidFolder(path));
        }

        static string InProject(string path)
        {
            return "Assets" + AssetPath(path.Substring(Application.dataPath.Length));
        }

        static string AssetPath(string path)
        {
            return path.Replace(Path.DirectorySeparatorChar, '/');
        }

        /// <summary>Builds recipes: now, or after the build that is running.</summary>
        public static void Build(string[] recipes)
        {
            if (Running) waiting = waiting.Union(recipes).ToArray();
            else Start(recipes);
        }

        static void Start(string[] recipes)
        {
            string command = RecipePreferences.Command, folder = Path.GetDirectoryName(Application.dataPath);
            try
            {
                build = RecipeBuild.Start(command, recipes, folder);
            }
            catch (Win32Exception)
            {
                Debug.LogError(string.Format(NotFound, command));
                return;
            }
            reported = false;
            progress = Progress.Start("Fire Atlas", "building recipes");
            Progress.RegisterCancelCallback(progress, () => { build.Stop(); return true; });
            // A reload of scripts would forget the build.
            EditorApplication.LockReloadAssemblies();
            EditorApplication.update += Watch;
        }

        static void Watch()
        {
            if (!build.Poll(Show)) End();
        }

        static void End()
        {
            EditorApplication.update -= Watch;
            EditorApplication.UnlockReloadAssemblies();
            bool stopped = Progress.GetStatus(progress) == Progress.Status.Canceled;
            bool failed = build.ExitCode != 0;
            if (failed && !reported && !stopped) Debug.LogError("Fire Atlas: " + build.Complaints());
            if (!stopped) Progress.Finish(progress, failed ? Progress.Status.Failed : Progress.Status.Succeeded);
            build.Dispose();
            build = null;
            string[] next = stopped ? new string[0] : waiting;
            waiting = new string[0];
            AssetDatabase.Refresh();
            if (next.Length > 0) Build(next);
        }

        static void Show(RecipeBuild.Line line)
        {
            Object recipe = string.IsNullOrEmpty(line.recipe) ? null : AssetDatabase.LoadMainAssetAtPath(AssetPath(line.recipe));
            switch (line.@event)
            {
                case "stage":
                    Progress.Report(progress, line.done, line.total, line.recipe + ": " + line.stage);
                    break;
                case "note":
                    Debug.Log(Prefixed(line), recipe);
                    break;
                case "error":
                    reported = true;
                    Debug.LogError(line.message, recipe);
                    break;
                case "done":
                    if (line.fresh) Debug.Log(line.recipe + ": is up to date", recipe);
                    else if (!line.files.Any(file => file.EndsWith(".prefab"))) Debug.LogWarning(string.Format(NoPrefab, line.recipe), recipe);
                    else Debug.Log(string.Format("{0}: wrote {1} files", line.recipe, line.files.Length), recipe);
                    break;
            }
        }

        static string Prefixed(RecipeBuild.Line line)
        {
            return string.IsNullOrEmpty(line.recipe) ? line.message : line.recipe + ": " + line.message;
        }
    }
}
