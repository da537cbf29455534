// Builds recipes as they are imported. Written by fire-atlas plugin unity.

namespace FireAtlas.Editor
{
    using global::System.Linq;
    using global::UnityEditor;

    /// <summary>Builds every .fire recipe that is new or has changed, if the preferences say so.</summary>
    public sealed class RecipeImport : AssetPostprocessor
    {
        static void OnPostprocessAllAssets(string[] imported, string[] deleted, string[] moved, string[] movedFrom)
        {
            if (!RecipePreferences.BuildOnImport) return;
            string[] recipes = imported.Where(path => path.EndsWith(".fire")).ToArray();
            if (recipes.Length > 0) RecipeMenu.Build(recipes);
        }
    }
}
